// OpenColorIO behind the C header. In order: its process-wide habits; a walk over everything that
// a configuration refers to, before OpenColorIO follows it; loading; the catalog; transforms.

#include "color/color.h"

#include <OpenColorIO/OpenColorIO.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "color/codes.h"
#include "color/file.h"
#include "color/metadata.h"
#include "color/text.h"

extern "C" {
extern const unsigned char shd_embedded_ocio[];
extern const unsigned long shd_embedded_ocio_size;
}

namespace OCIO = OCIO_NAMESPACE;

struct shd_color_transform {
    OCIO::ConstCPUProcessorRcPtr cpu; // null: the transform does nothing
    shd_color_info info{};
    std::string name;

    // Of 8 and 16 bits; null also if baking failed.
    struct Codes {
        std::atomic<size_t> asked{0}; // pixels
        std::atomic<bool> done{false};
        std::mutex baking;
        std::unique_ptr<shd_color_codes, decltype(&shd_color_codes_drop)> baked{
            nullptr, shd_color_codes_drop};
    };
    mutable Codes codes[2];
};

struct shd_color_config {
    OCIO::ConstConfigRcPtr ocio;
    std::string digest;

    // The catalog and what it points into; constant once loaded.
    shd_catalog catalog{};
    std::deque<std::string> texts;
    std::vector<shd_space_info> spaces;
    std::vector<shd_display_info> displays;
    std::deque<std::vector<const char *>> views;

    std::mutex mutex; // guards `transforms`, not what they point to
    std::map<std::string, std::unique_ptr<shd_color_transform>> transforms;
};

namespace {

constexpr size_t max_config_bytes = 16u << 20;
constexpr size_t max_referenced_bytes = 256u << 20;
constexpr size_t room_to_read = 32u << 20;
constexpr size_t max_reference_depth = 64;
// Pixels that are handed to OpenColorIO at a time; their alphas are kept on the stack meanwhile.
constexpr size_t block = 1024;

// Makes one line of text, without a trailing period. Bytes that are no text become question marks.
std::string sentence(const char *text) {
    bool clean = shd_color_is_text(text);
    std::string out;
    for (; *text; text++) {
        unsigned char byte = static_cast<unsigned char>(*text);
        if (byte > ' ')
            out += clean || byte < 0x7f ? *text : '?';
        else if (!out.empty() && out.back() != ' ')
            out += ' ';
    }
    while (!out.empty() && (out.back() == ' ' || out.back() == '.')) out.pop_back();
    return out;
}

// Runs `body` and turns whatever it throws into `status`, and whatever telling of that throws.
template <typename Body>
shd_status guarded(shd_status status, const char *path, shd_error *error, Body body) {
    try {
        try {
            return body();
        } catch (const std::bad_alloc &) {
            throw;
        } catch (const std::exception &e) {
            return shd_fail(error, status, path, "%s", sentence(e.what()).c_str());
        }
    } catch (const std::bad_alloc &) {
        return shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    } catch (...) {
        return shd_fail(error, status, path, "OpenColorIO failed without a reason");
    }
}

// The library never logs, and a user's OCIO_* variables must not change what a scene looks like.
void quiet_the_process() {
    static std::once_flag once;
    std::call_once(once, [] {
        std::vector<std::string> names;
        for (char **entry = environ; entry && *entry; entry++) {
            std::string name(*entry, std::strcspn(*entry, "="));
            if (name == "OCIO" || name.rfind("OCIO_", 0) == 0) names.push_back(name);
        }
        for (const std::string &name : names) unsetenv(name.c_str());
        OCIO::SetLoggingLevel(OCIO::LOGGING_LEVEL_NONE);
        OCIO::SetLoggingFunction([](const char *) {});
    });
}

// Visits everything that the active spaces, displays and views refer to. OpenColorIO follows
// references by recursion without an end and opens any path, so this refuses circles, chains
// that are too deep and files that are not regular before a processor is built.
class Walk {
  public:
    explicit Walk(const OCIO::ConstConfigRcPtr &config)
        : config_(config), context_(config->getCurrentContext()) {}

    void space(const char *name) {
        const char *resolved = context_->resolveStringVar(name);
        OCIO::ConstColorSpaceRcPtr found = config_->getColorSpace(resolved);
        if (!found) return named(resolved);
        node("color space '" + std::string(found->getName()) + "'", [&] {
            transform(found->getTransform(OCIO::COLORSPACE_DIR_TO_REFERENCE));
            transform(found->getTransform(OCIO::COLORSPACE_DIR_FROM_REFERENCE));
        });
    }

    void view(const char *display, const char *name) {
        node("view '" + std::string(display) + " / " + name + "'", [&] {
            const char *target = config_->getDisplayViewColorSpaceName(display, name);
            space(std::strcmp(target, OCIO::OCIO_VIEW_USE_DISPLAY_NAME) ? target : display);
            const char *through = config_->getDisplayViewTransformName(display, name);
            if (*through) view_transform(config_->getViewTransform(through));
            looks(config_->getDisplayViewLooks(display, name));
        });
    }

    // Between the scene's and the displays' reference spaces.
    void bridge() { view_transform(config_->getDefaultSceneToDisplayViewTransform()); }

    const std::set<std::string> &files() const { return files_; }

  private:
    template <typename Body> void node(const std::string &key, Body body) {
        if (done_.count(key)) return;
        for (size_t i = 0; i < path_.size(); i++)
            if (path_[i] == key) throw std::runtime_error("circular definition: " + chain(i, key));
        if (path_.size() >= max_reference_depth)
            throw std::runtime_error("references are nested too deeply at " + key);
        path_.push_back(key);
        body();
        path_.pop_back();
        done_.insert(key);
    }

    std::string chain(size_t from, const std::string &last) const {
        std::string out;
        for (size_t i = from; i < path_.size(); i++) out += path_[i] + " -> ";
        return out + last;
    }

    void named(const char *name) {
        OCIO::ConstNamedTransformRcPtr found = config_->getNamedTransform(name);
        if (!found) return; // OpenColorIO says so when it builds
        node("named transform '" + std::string(found->getName()) + "'", [&] {
            transform(found->getTransform(OCIO::TRANSFORM_DIR_FORWARD));
            transform(found->getTransform(OCIO::TRANSFORM_DIR_INVERSE));
        });
    }

    void view_transform(const OCIO::ConstViewTransformRcPtr &found) {
        if (!found) return;
        node("view transform '" + std::string(found->getName()) + "'", [&] {
            transform(found->getTransform(OCIO::VIEWTRANSFORM_DIR_TO_REFERENCE));
            transform(found->getTransform(OCIO::VIEWTRANSFORM_DIR_FROM_REFERENCE));
        });
    }

    // "+look, -look | fallback": signs are directions, and a look may be an empty word.
    void looks(const char *text) {
        std::string names(text);
        for (size_t at = 0; at < names.size();) {
            size_t begin = names.find_first_not_of(",:|+- \t", at);
            if (begin == std::string::npos) return;
            size_t end = std::min(names.find_first_of(",:|", begin), names.size());
            at = end;
            while (end > begin && (names[end - 1] == ' ' || names[end - 1] == '\t')) end--;
            OCIO::ConstLookRcPtr look = config_->getLook(names.substr(begin, end - begin).c_str());
            if (!look) continue;
            node("look '" + std::string(look->getName()) + "'", [&] {
                space(look->getProcessSpace());
                transform(look->getTransform());
                transform(look->getInverseTransform());
            });
        }
    }

    void convert(const char *from, const char *to) {
        space(from);
        space(to);
        OCIO::ConstColorSpaceRcPtr a = config_->getColorSpace(context_->resolveStringVar(from));
        OCIO::ConstColorSpaceRcPtr b = config_->getColorSpace(context_->resolveStringVar(to));
        if (a && b && a->getReferenceSpaceType() != b->getReferenceSpaceType()) bridge();
    }

    void file(const char *source) {
        std::string path = context_->resolveFileLocation(source); // throws if it is missing
        struct stat info;
        if (stat(path.c_str(), &info) || !S_ISREG(info.st_mode))
            throw std::runtime_error("'" + path + "' is not a regular file");
        files_.insert(path);
    }

    void transform(const OCIO::ConstTransformRcPtr &t) {
        using namespace OCIO;
        if (!t) return;
        if (auto group = DynamicPtrCast<const GroupTransform>(t)) {
            for (int i = 0; i < group->getNumTransforms(); i++) transform(group->getTransform(i));
        } else if (auto color = DynamicPtrCast<const ColorSpaceTransform>(t)) {
            convert(color->getSrc(), color->getDst());
        } else if (auto look = DynamicPtrCast<const LookTransform>(t)) {
            convert(look->getSrc(), look->getDst());
            looks(look->getLooks());
        } else if (auto shown = DynamicPtrCast<const DisplayViewTransform>(t)) {
            space(shown->getSrc());
            view(shown->getDisplay(), shown->getView());
        } else if (auto lut = DynamicPtrCast<const FileTransform>(t)) {
            file(lut->getSrc());
        }
    }

    OCIO::ConstConfigRcPtr config_;
    OCIO::ConstContextRcPtr context_;
    std::vector<std::string> path_; // nodes that are being visited, outermost first
    std::set<std::string> done_, files_;
};

bool is_display_space(const OCIO::ConstColorSpaceRcPtr &space) {
    return space->getReferenceSpaceType() == OCIO::REFERENCE_SPACE_DISPLAY;
}

// A hash of everything that decides on colors: the library, the configuration and its files.
shd_status digest(shd_color_config *config, const std::string &text,
                  const std::set<std::string> &files, shd_error *error) {
    std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(),
                                                                   XXH3_freeState);
    if (!state) throw std::bad_alloc();
    XXH3_128bits_reset(state.get());
    XXH3_128bits_update(state.get(), OCIO::GetVersion(), std::strlen(OCIO::GetVersion()) + 1);
    XXH3_128bits_update(state.get(), text.data(), text.size());
    for (const std::string &path : files) {
        char *data = nullptr;
        size_t size = 0;
        shd_status status =
            shd_color_read_file(path.c_str(), max_referenced_bytes, &data, &size, error);
        if (status) return status;
        XXH3_128bits_update(state.get(), &size, sizeof size);
        XXH3_128bits_update(state.get(), data, size);
        std::free(data);
    }
    XXH128_hash_t hash = XXH3_128bits_digest(state.get());
    char hex[33];
    std::snprintf(hex, sizeof hex, "%016llx%016llx", static_cast<unsigned long long>(hash.high64),
                  static_cast<unsigned long long>(hash.low64));
    config->digest = hex;
    return SHD_OK;
}

const char *keep(shd_color_config *config, const std::string &text) {
    if (!shd_color_is_text(text.c_str()))
        throw std::runtime_error("the name '" + sentence(text.c_str()) + "' is not UTF-8 text");
    config->texts.push_back(text);
    return config->texts.back().c_str();
}

shd_channels channels_of(const OCIO::ConstColorSpaceRcPtr &space) {
    return space->hasCategory("yiq") ? SHD_YIQ : space->hasCategory("hsv") ? SHD_HSV : SHD_RGB;
}

bool is_scene_linear(const OCIO::ConstColorSpaceRcPtr &space) {
    return !space->isData() && !strcasecmp(space->getEncoding(), "scene-linear");
}

const shd_space_info *first_of(const shd_catalog &catalog, const char *a, const char *b) {
    const shd_space_info *found = shd_catalog_space(&catalog, a);
    return found ? found : shd_catalog_space(&catalog, b);
}

shd_status convert(const void *self, const char *from, const char *to, double rgb[3],
                   shd_error *error);

void fill_catalog(shd_color_config *config) {
    const OCIO::ConstConfigRcPtr &ocio = config->ocio;
    std::string linear = ocio->getColorSpace(OCIO::ROLE_SCENE_LINEAR)->getName();
    for (int i = 0; i < ocio->getNumColorSpaces(); i++) {
        OCIO::ConstColorSpaceRcPtr space = ocio->getColorSpace(ocio->getColorSpaceNameByIndex(i));
        bool working = space->getName() == linear || is_scene_linear(space);
        config->spaces.push_back({keep(config, space->getName()),
                                  keep(config, sentence(space->getDescription())),
                                  channels_of(space), working});
    }
    for (int i = 0; i < ocio->getNumDisplays(); i++) {
        const char *display = ocio->getDisplay(i);
        std::vector<const char *> views;
        for (int j = 0; j < ocio->getNumViews(display); j++)
            views.push_back(keep(config, ocio->getView(display, j)));
        config->views.push_back(views);
        config->displays.push_back(
            {keep(config, display), config->views.back().data(), config->views.back().size()});
    }
    shd_catalog &catalog = config->catalog;
    catalog.spaces = config->spaces.data();
    catalog.space_count = config->spaces.size();
    catalog.displays = config->displays.data();
    catalog.display_count = config->displays.size();
    catalog.scene_linear = shd_catalog_space(&catalog, linear.c_str());
    catalog.colors = first_of(catalog, "lin_rec709", "Linear Rec.709 (sRGB)");
    if (!catalog.colors) catalog.colors = catalog.scene_linear;
    catalog.css = first_of(catalog, "sRGB", "sRGB - Texture");
    catalog.convert = convert;
    catalog.self = config;
}

// The transform for `key`; `make` makes it if it is not there yet.
template <typename Make>
shd_status cached(shd_color_config *config, const std::string &key, Make make,
                  const shd_color_transform **out) {
    std::lock_guard<std::mutex> lock(config->mutex);
    std::unique_ptr<shd_color_transform> &entry = config->transforms[key];
    try {
        if (!entry) entry = make();
    } catch (...) {
        config->transforms.erase(key);
        throw;
    }
    *out = entry.get();
    return SHD_OK;
}

// LOSSLESS leaves out the fast approximations of log, exp and pow, and resampled tables.
OCIO::ConstCPUProcessorRcPtr build(const OCIO::ConstProcessorRcPtr &processor) {
    OCIO::ConstCPUProcessorRcPtr cpu = processor->getOptimizedCPUProcessor(
        OCIO::BIT_DEPTH_F32, OCIO::BIT_DEPTH_F32, OCIO::OPTIMIZATION_LOSSLESS);
    return cpu->isNoOp() ? nullptr : cpu;
}

void describe(shd_color_info *info, const shd_encoding *encoding) {
    if (!encoding) return;
    info->transfer = encoding->transfer;
    info->has_primaries = true;
    std::memcpy(info->primaries, encoding->primaries, sizeof info->primaries);
}

std::unique_ptr<shd_color_transform> make_to_space(const shd_color_config *config, const char *from,
                                                   const char *to) {
    std::unique_ptr<shd_color_transform> made(new shd_color_transform);
    OCIO::ConstColorSpaceRcPtr target = config->ocio->getColorSpace(to);
    if (std::strcmp(from, to)) made->cpu = build(config->ocio->getProcessor(from, to));
    made->name = to;
    made->info.name = made->name.c_str();
    made->info.channels = channels_of(target);
    // Nothing happens on the way to a data space: the values are still those of `from`.
    describe(&made->info, shd_encoding_of_space(target->isData() ? from : to));
    if (!made->info.has_primaries && is_scene_linear(target))
        made->info.transfer = SHD_TRANSFER_LINEAR;
    return made;
}

std::unique_ptr<shd_color_transform> make_to_view(const shd_color_config *config, const char *from,
                                                  const char *display, const char *view) {
    std::unique_ptr<shd_color_transform> made(new shd_color_transform);
    const OCIO::ConstConfigRcPtr &ocio = config->ocio;
    made->cpu = build(ocio->getProcessor(from, display, view, OCIO::TRANSFORM_DIR_FORWARD));
    made->name = std::string(display) + " / " + view;
    made->info.name = made->name.c_str();
    OCIO::ConstColorSpaceRcPtr target =
        ocio->getColorSpace(ocio->getDisplayViewColorSpaceName(display, view));
    bool raw = target && target->isData();
    made->info.channels = target ? channels_of(target) : SHD_RGB;
    describe(&made->info, raw ? shd_encoding_of_space(from) : shd_encoding_of_display(display));
    return made;
}

shd_status unknown(shd_error *error, const char *what, const char *name) {
    return shd_fail(error, SHD_SCENE, "", "unknown %s '%.64s'", what, name);
}

// IEC 61966-2-1, in f64: colors that people write get no rounding of a float. Nor do they get the
// toe of another standard if an operator's configuration has OpenColorIO's own sRGB, which
// is 2.5e-4 darker there. Below 0 the line goes on, as in config/shaded.ocio.
double decode_srgb(double v) {
    return v < 0 ? v / 12.92 : shd_curve_decode(SHD_TRANSFER_SRGB, v);
}

bool is_linear_rec709(const shd_space_info *space) {
    const shd_encoding *encoding = shd_encoding_of_space(space->name);
    const shd_encoding *srgb = shd_encoding_of_space("sRGB");
    return encoding && srgb && encoding->transfer == SHD_TRANSFER_LINEAR &&
           encoding->primaries == srgb->primaries;
}

shd_status convert(const void *self, const char *from, const char *to, double rgb[3],
                   shd_error *error) {
    if (!std::strcmp(from, to)) return SHD_OK;
    // The catalog is const for its users; its cache has a mutex.
    auto config = const_cast<shd_color_config *>(static_cast<const shd_color_config *>(self));
    const shd_catalog &catalog = config->catalog;
    bool css =
        catalog.css && is_linear_rec709(catalog.colors) && !std::strcmp(from, catalog.css->name);
    double value[3] = {rgb[0], rgb[1], rgb[2]};
    if (css) {
        for (double &v : value) v = decode_srgb(v);
        from = catalog.colors->name;
        if (!std::strcmp(from, to)) {
            std::memcpy(rgb, value, sizeof value);
            return SHD_OK;
        }
    }
    const shd_color_transform *transform = nullptr;
    shd_status status = shd_color_to_space(config, from, to, &transform, error);
    if (status) return status;
    if (!transform->cpu && !css) return SHD_OK;
    float pixel[4] = {static_cast<float>(value[0]), static_cast<float>(value[1]),
                      static_cast<float>(value[2]), 1};
    if (transform->cpu) shd_color_apply(transform, pixel, 1);
    for (int i = 0; i < 3; i++)
        if (!std::isfinite(pixel[i]))
            return shd_fail(error, SHD_SCENE, "", "the color is too large to be converted");
    for (int i = 0; i < 3; i++) rgb[i] = static_cast<double>(pixel[i]);
    return SHD_OK;
}

// Refuses mistakes that OpenColorIO's own validation lets through, and builds every processor once.
void check(shd_color_config *config, std::set<std::string> *files) {
    const OCIO::ConstConfigRcPtr &ocio = config->ocio;
    ocio->validate();
    OCIO::ConstColorSpaceRcPtr linear = ocio->getColorSpace(OCIO::ROLE_SCENE_LINEAR);
    if (!ocio->hasRole(OCIO::ROLE_SCENE_LINEAR) || !linear)
        throw std::runtime_error("the role scene_linear is missing");
    if (linear->isData())
        throw std::runtime_error("the role scene_linear names a data space, which cannot be "
                                 "converted");
    if (!ocio->getNumDisplays()) throw std::runtime_error("there is no display");

    Walk walk(ocio);
    for (int i = 0; i < ocio->getNumColorSpaces(); i++) {
        const char *name = ocio->getColorSpaceNameByIndex(i);
        walk.space(name);
        if (is_display_space(ocio->getColorSpace(name))) walk.bridge();
    }
    for (int i = 0; i < ocio->getNumDisplays(); i++)
        for (int j = 0; j < ocio->getNumViews(ocio->getDisplay(i)); j++)
            walk.view(ocio->getDisplay(i), ocio->getView(ocio->getDisplay(i), j));
    *files = walk.files();

    fill_catalog(config);
    const shd_catalog &catalog = config->catalog;
    if (!catalog.scene_linear)
        throw std::runtime_error("the role scene_linear names an inactive space");
    const char *working = catalog.scene_linear->name;
    const shd_color_transform *made;
    shd_error error;
    for (size_t i = 0; i < catalog.space_count; i++) {
        const char *name = catalog.spaces[i].name;
        if (shd_color_to_space(config, working, name, &made, &error) ||
            shd_color_to_space(config, name, working, &made, &error))
            throw std::runtime_error("color space '" + std::string(name) + "': " + error.text);
    }
    for (size_t i = 0; i < catalog.display_count; i++)
        for (size_t j = 0; j < catalog.displays[i].view_count; j++) {
            const char *display = catalog.displays[i].name, *view = catalog.displays[i].views[j];
            if (shd_color_to_view(config, working, display, view, &made, &error))
                throw std::runtime_error("display '" + std::string(display) + "', view '" + view +
                                         "': " + error.text);
        }
}

std::string folder_of(const std::string &path) {
    size_t slash = path.rfind('/');
    return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

} // namespace

extern "C" {

shd_status shd_color_config_load(const char *path, shd_color_config **out, shd_error *error) {
    const char *where = path ? path : "";
    return guarded(SHD_CONFIG, where, error, [&]() -> shd_status {
        quiet_the_process();
        // OpenColorIO allocates in functions that are declared noexcept, and ends the process if
        // there is no memory. So room for an ordinary configuration is asked for beforehand.
        operator delete(operator new(room_to_read));
        std::string text(reinterpret_cast<const char *>(shd_embedded_ocio), shd_embedded_ocio_size);
        if (path) {
            char *data = nullptr;
            size_t size = 0;
            shd_status status = shd_color_read_file(path, max_config_bytes, &data, &size, error);
            if (status) return status;
            std::unique_ptr<char, decltype(&std::free)> owner(data, std::free);
            text.assign(data, size);
        }
        // OpenColorIO remembers files, missing ones included; that would outlive a correction.
        OCIO::ClearAllCaches();
        std::istringstream stream(text);
        OCIO::ConfigRcPtr editable = OCIO::Config::CreateFromStream(stream)->createEditableCopy();
        if (path) editable->setWorkingDir(folder_of(path).c_str());

        std::unique_ptr<shd_color_config> config(new shd_color_config);
        config->ocio = editable;
        std::set<std::string> files;
        check(config.get(), &files);
        shd_status status = digest(config.get(), text, files, error);
        if (status == SHD_OK) *out = config.release();
        return status;
    });
}

void shd_color_config_drop(shd_color_config *config) {
    delete config;
}

const shd_catalog *shd_color_catalog(const shd_color_config *config) {
    return &config->catalog;
}

const char *shd_color_config_digest(const shd_color_config *config) {
    return config->digest.c_str();
}

shd_status shd_color_to_space(shd_color_config *config, const char *from, const char *to,
                              const shd_color_transform **out, shd_error *error) {
    // Exact names only: OpenColorIO would take roles and other case for spaces, too.
    if (!shd_catalog_space(&config->catalog, from)) return unknown(error, "color space", from);
    if (!shd_catalog_space(&config->catalog, to)) return unknown(error, "color space", to);
    return guarded(SHD_INTERNAL, "", error, [&] {
        std::string key = std::string(from) + '\0' + to;
        return cached(
            config, key, [&] { return make_to_space(config, from, to); }, out);
    });
}

shd_status shd_color_to_view(shd_color_config *config, const char *from, const char *display,
                             const char *view, const shd_color_transform **out, shd_error *error) {
    if (!shd_catalog_space(&config->catalog, from)) return unknown(error, "color space", from);
    const shd_display_info *found = shd_catalog_display(&config->catalog, display);
    if (!found) return unknown(error, "display", display);
    bool known = false;
    for (size_t i = 0; i < found->view_count; i++)
        known = known || !std::strcmp(found->views[i], view);
    if (!known) return unknown(error, "view", view);
    return guarded(SHD_INTERNAL, "", error, [&] {
        std::string key = std::string(from) + '\0' + display + '\0' + view;
        return cached(
            config, key, [&] { return make_to_view(config, from, display, view); }, out);
    });
}

const shd_color_info *shd_color_describe(const shd_color_transform *transform) {
    return &transform->info;
}

// Matrices in float leave a grey's channels a few ulps apart, and a hue made from that would be
// noise. So as little saturation as that counts as none. Hues just below red round up to 1, which
// is hue 0.
static void settle_hue(float *hsv) {
    if (hsv[1] < 2e-6f) hsv[0] = hsv[1] = 0;
    if (hsv[0] >= 1) hsv[0] = 0x1.fffffep-1f;
}

void shd_color_apply(const shd_color_transform *transform, float *rgba, size_t count) {
    if (!transform->cpu) return;
    for (size_t pixels; count; rgba += 4 * pixels, count -= pixels) {
        pixels = std::min(count, block);
        float alpha[block];
        for (size_t i = 0; i < pixels; i++) alpha[i] = rgba[4 * i + 3];
        try {
            OCIO::PackedImageDesc row(rgba, static_cast<long>(pixels), 1, 4);
            transform->cpu->apply(row);
        } catch (...) {
            // Applying to rows allocates one; pixel by pixel does not, and gives the same bits.
            for (size_t i = 0; i < pixels; i++) transform->cpu->applyRGBA(rgba + 4 * i);
        }
        // OpenColorIO's 4 x 4 matrices mix alpha in if a color overflows.
        for (size_t i = 0; i < pixels; i++) rgba[4 * i + 3] = alpha[i];
        if (transform->info.channels == SHD_HSV)
            for (size_t i = 0; i < pixels; i++) settle_hue(rgba + 4 * i);
    }
}

bool shd_color_mixes(const shd_color_transform *transform) {
    try {
        return transform->cpu && transform->cpu->hasChannelCrosstalk();
    } catch (...) {
        return true;
    }
}

const shd_color_codes *shd_color_codes_of(const shd_color_transform *transform, unsigned max,
                                          size_t pixels, shd_color_go_on *go_on,
                                          const void *context) {
    shd_color_transform::Codes &codes = transform->codes[max == 255 ? 0 : 1];
    // Baking takes as long as converting this many pixels to floats, as measured.
    const size_t enough = max == 255 ? size_t{1} << 14 : size_t{3} << 19;
    size_t before = codes.asked.load(std::memory_order_relaxed);
    if (before < enough) {
        pixels = std::min(pixels, enough);
        if (codes.asked.fetch_add(pixels, std::memory_order_relaxed) + pixels < enough)
            return nullptr;
    }
    if (!codes.done) {
        std::unique_lock<std::mutex> lock(codes.baking, std::try_to_lock);
        if (!lock) return nullptr;
        if (!codes.done) {
            codes.baked.reset(shd_color_codes_bake(transform, max, go_on, context));
            codes.done = codes.baked || !go_on || go_on(context);
        }
    }
    return codes.baked.get();
}

} // extern "C"
