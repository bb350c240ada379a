// Configurations: OpenColorIO's process-wide habits, loading, the catalog.

#include <strings.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>

#include "color/file.h"
#include "color/ocio.hpp"
#include "color/text.h"

extern "C" {
extern const unsigned char shd_embedded_ocio[];
extern const unsigned long shd_embedded_ocio_size;
}

namespace {

constexpr size_t max_config_bytes = 16u << 20;
constexpr size_t max_referenced_bytes = 256u << 20;
constexpr char interchange[] = "aces_interchange";
constexpr size_t room_to_read = 32u << 20;

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
        config->file_bytes += size;
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
        throw std::runtime_error("the name '" + shd_ocio_sentence(text.c_str()) +
                                 "' is not UTF-8 text");
    config->texts.push_back(text);
    return config->texts.back().c_str();
}

const shd_space_info *first_of(const shd_catalog &catalog,
                               std::initializer_list<const char *> names) {
    for (const char *name : names)
        if (const shd_space_info *found = shd_catalog_space(&catalog, name)) return found;
    return nullptr;
}

// Whether the configuration says in which space people pick colors.
bool has_picking(const OCIO::ConstConfigRcPtr &config) {
    OCIO::ConstColorSpaceRcPtr space = config->getColorSpace(OCIO::ROLE_COLOR_PICKING);
    return config->hasRole(OCIO::ROLE_COLOR_PICKING) && space && !space->isData();
}

shd_holds holds_of(const OCIO::ConstColorSpaceRcPtr &space) {
    if (!space || space->isData()) return SHD_HOLDS_DATA;
    const bool light =
        shd_ocio_is_linear(space) || !strcasecmp(space->getEncoding(), "display-linear");
    return light ? SHD_HOLDS_LIGHT : SHD_HOLDS_CODES;
}

void fill_space(shd_color_config *config, const OCIO::ConstColorSpaceRcPtr &space, bool working,
                const std::vector<OCIO::ConstColorSpaceRcPtr> &of_roles) {
    std::vector<const char *> aliases;
    for (size_t i = 0; i < space->getNumAliases(); i++)
        aliases.push_back(keep(config, space->getAlias(i)));
    for (size_t i = 0; i < of_roles.size(); i++)
        if (of_roles[i] == space)
            aliases.push_back(keep(config, config->ocio->getRoleName(static_cast<int>(i))));
    config->aliases.push_back(aliases);
    config->spaces.push_back({keep(config, space->getName()),
                              keep(config, shd_ocio_sentence(space->getDescription())),
                              shd_ocio_channels(space), working || shd_ocio_is_linear(space),
                              config->aliases.back().data(), aliases.size(),
                              working ? SHD_HOLDS_LIGHT : holds_of(space), nullptr});
}

void fill_looks(shd_color_config *config) {
    const OCIO::ConstConfigRcPtr &ocio = config->ocio;
    for (int i = 0; i < ocio->getNumLooks(); i++) {
        const std::string name = ocio->getLookNameByIndex(i);
        // OpenColorIO takes these for a list, or a direction.
        if (name.empty() || name.find_first_of(",:|\n") != std::string::npos ||
            name.find_first_of("+-") == 0)
            continue;
        const char *about = ocio->getLook(name.c_str())->getDescription();
        config->looks.push_back({keep(config, name), keep(config, shd_ocio_sentence(about))});
    }
}

void fill_catalog(shd_color_config *config) {
    const OCIO::ConstConfigRcPtr &ocio = config->ocio;
    OCIO::ConstColorSpaceRcPtr linear = ocio->getColorSpace(OCIO::ROLE_SCENE_LINEAR);
    std::vector<OCIO::ConstColorSpaceRcPtr> of_roles;
    for (int i = 0; i < ocio->getNumRoles(); i++)
        of_roles.push_back(ocio->getColorSpace(ocio->getRoleName(i)));
    for (const OCIO::ConstColorSpaceRcPtr &space : shd_ocio_spaces(ocio))
        fill_space(config, space, space == linear, of_roles);
    shd_color_add_polar(config);
    for (const shd_color_polar &polar : config->polar)
        config->spaces.push_back({polar.name.c_str(), polar.description.c_str(), SHD_LCH, false,
                                  polar.aliases.data(), polar.aliases.size(), SHD_HOLDS_CODES,
                                  nullptr});
    for (int i = 0; i < ocio->getNumDisplays(); i++) {
        const char *display = ocio->getDisplay(i);
        std::vector<const char *> views;
        std::vector<shd_holds> holds;
        for (int j = 0; j < ocio->getNumViews(display); j++) {
            views.push_back(keep(config, ocio->getView(display, j)));
            holds.push_back(holds_of(shd_ocio_target(ocio, display, views.back())));
        }
        config->views.push_back(views);
        config->holds.push_back(holds);
        config->displays.push_back({keep(config, display), config->views.back().data(),
                                    views.size(), config->holds.back().data()});
    }
    fill_looks(config);
    shd_catalog &catalog = config->catalog;
    catalog.looks = config->looks.data();
    catalog.look_count = config->looks.size();
    catalog.spaces = config->spaces.data();
    catalog.space_count = config->spaces.size();
    for (shd_space_info &space : config->spaces)
        if (space.channels != SHD_RGB)
            space.file = shd_catalog_space(&catalog, (std::string(space.name) + " file").c_str());
    catalog.displays = config->displays.data();
    catalog.display_count = config->displays.size();
    catalog.scene_linear = shd_catalog_space(&catalog, linear->getName());
    catalog.rec709 =
        first_of(catalog, {"lin_rec709", "lin_rec709_srgb", "lin_srgb", "Linear Rec.709 (sRGB)"});
    catalog.colors = catalog.rec709 ? catalog.rec709 : catalog.scene_linear;
    catalog.css = first_of(
        catalog, {"sRGB", "srgb_tx", "srgb_texture", "sRGB - Texture", "Utility - sRGB - Texture"});
    if (!catalog.css && has_picking(ocio))
        catalog.css = shd_catalog_space(&catalog, OCIO::ROLE_COLOR_PICKING);
    catalog.convert = shd_ocio_convert;
    catalog.self = config;
}

// What takes a space's reference to the space, or the other way.
OCIO::TransformRcPtr reference_step(const OCIO::ConstColorSpaceRcPtr &space, bool to_space) {
    using namespace OCIO;
    const auto wanted = to_space ? COLORSPACE_DIR_FROM_REFERENCE : COLORSPACE_DIR_TO_REFERENCE;
    const auto other = to_space ? COLORSPACE_DIR_TO_REFERENCE : COLORSPACE_DIR_FROM_REFERENCE;
    GroupTransformRcPtr step = GroupTransform::Create();
    if (ConstTransformRcPtr there = space->getTransform(wanted)) {
        step->appendTransform(there->createEditableCopy());
    } else if (ConstTransformRcPtr back = space->getTransform(other)) {
        step->appendTransform(back->createEditableCopy());
        step->setDirection(TRANSFORM_DIR_INVERSE);
    }
    return step;
}

bool is_known(const OCIO::ConstConfigRcPtr &config, const char *name) {
    return config->getColorSpace(name) || config->getNamedTransform(name);
}

// Adds the built-in spaces that documents count on, and that the configuration has under none of
// their names. The role aces_interchange tells how the two references are connected.
void lend_spaces(const OCIO::ConfigRcPtr &config, const std::string &built_in) {
    OCIO::ConstColorSpaceRcPtr there = config->getColorSpace(interchange);
    if (!config->hasRole(interchange) || !there ||
        there->getReferenceSpaceType() != OCIO::REFERENCE_SPACE_SCENE)
        return;
    std::istringstream stream(built_in);
    OCIO::ConstConfigRcPtr own = OCIO::Config::CreateFromStream(stream);
    OCIO::ConstColorSpaceRcPtr here = own->getColorSpace(interchange);
    for (int i = 0; i < own->getNumColorSpaces(); i++) {
        const std::string name = own->getColorSpaceNameByIndex(i);
        OCIO::ColorSpaceRcPtr space = own->getColorSpace(name.c_str())->createEditableCopy();
        if (name != "lin_rec709" && name != "sRGB" && shd_ocio_channels(space) == SHD_RGB) continue;
        if (space->getReferenceSpaceType() != OCIO::REFERENCE_SPACE_SCENE) continue;
        bool known = is_known(config, name.c_str()) || (name == "sRGB" && has_picking(config));
        for (size_t k = 0; k < space->getNumAliases(); k++)
            known = known || is_known(config, space->getAlias(k));
        if (known) continue;
        OCIO::GroupTransformRcPtr way = OCIO::GroupTransform::Create();
        way->appendTransform(reference_step(there, true));
        way->appendTransform(reference_step(here, false));
        way->appendTransform(reference_step(space, true));
        space->setTransform(way, OCIO::COLORSPACE_DIR_FROM_REFERENCE);
        config->addColorSpace(space);
    }
}

// The built-in configuration without the lines that are for people and other programs. They are
// half of it, and OpenColorIO takes a thousand instructions for a character.
std::string what_counts(const std::string &text) {
    static const char *const others[] = {"#",
                                         "family:",
                                         "bitdepth:",
                                         "isdata: false",
                                         "file_rules:",
                                         "- !<Rule>",
                                         "categories: [basic-",
                                         "categories: [file-io",
                                         "categories: [working-space"};
    std::string out;
    for (size_t at = 0, end; at < text.size(); at = end) {
        end = std::min(text.find('\n', at), text.size() - 1) + 1;
        const size_t begin = std::min(text.find_first_not_of(' ', at), end);
        const bool counts = std::none_of(std::begin(others), std::end(others), [&](const char *of) {
            return !text.compare(begin, std::strlen(of), of);
        });
        if (counts) out.append(text, at, end - at);
    }
    return out;
}

// The ACES 2.0 views of the built-in configuration, named as in the Academy's configurations:
struct Rendering {
    const char *displays[3], *view, *style;
};
const Rendering aces_2[] = {
    {{"sRGB", "Rec.1886"}, "SDR 100 nits (Rec.709)", "SDR-100nit-REC709"},
    {{"Display P3", "Rec.2020", "P3-D65"}, "SDR 100 nits (P3 D65)", "SDR-100nit-P3-D65"},
    {{"ST2084-P3-D65"}, "HDR 108 nits (P3 D65)", "HDR-108nit-P3-D65"},
    {{"Rec.2100-PQ", "Rec.2100-HLG"}, "HDR 1000 nits (Rec.2020)", "HDR-1000nit-REC2020"},
    {{"Rec.2100-PQ", "Rec.2100-HLG", "ST2084-P3-D65"},
     "HDR 1000 nits (P3 D65)",
     "HDR-1000nit-P3-D65"},
    {{"Rec.2100-PQ"}, "HDR 2000 nits (Rec.2020)", "HDR-2000nit-REC2020"},
    {{"Rec.2100-PQ", "ST2084-P3-D65"}, "HDR 2000 nits (P3 D65)", "HDR-2000nit-P3-D65"},
    {{"Rec.2100-PQ"}, "HDR 4000 nits (Rec.2020)", "HDR-4000nit-REC2020"},
    {{"Rec.2100-PQ", "ST2084-P3-D65"}, "HDR 4000 nits (P3 D65)", "HDR-4000nit-P3-D65"}};

bool is_builtin(const std::string &style) {
    OCIO::ConstBuiltinTransformRegistryRcPtr registry = OCIO::BuiltinTransformRegistry::Get();
    for (size_t i = 0; i < registry->getNumBuiltins(); i++)
        if (style == registry->getBuiltinStyle(i)) return true;
    return false;
}

// Adds what the linked OpenColorIO has of them (2.4 and later), behind the other views.
OCIO::ConstConfigRcPtr with_aces_2(const OCIO::ConstConfigRcPtr &built_in) {
    const auto style_of = [](const Rendering &of) {
        return std::string("ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - ") + of.style + "_2.0";
    };
    if (!is_builtin(style_of(aces_2[0]))) return built_in;
    OCIO::ConfigRcPtr config = built_in->createEditableCopy();
    config->setVersion(2, 4);
    for (const Rendering &of : aces_2) {
        const std::string name = std::string("ACES 2.0 - ") + of.view;
        OCIO::ColorSpaceTransformRcPtr to_aces = OCIO::ColorSpaceTransform::Create();
        to_aces->setSrc(OCIO::ROLE_SCENE_LINEAR);
        to_aces->setDst(interchange);
        OCIO::BuiltinTransformRcPtr render = OCIO::BuiltinTransform::Create();
        render->setStyle(style_of(of).c_str());
        OCIO::GroupTransformRcPtr way = OCIO::GroupTransform::Create();
        way->appendTransform(to_aces);
        way->appendTransform(render);
        OCIO::ViewTransformRcPtr shown = OCIO::ViewTransform::Create(OCIO::REFERENCE_SPACE_SCENE);
        shown->setName(name.c_str());
        shown->setTransform(way, OCIO::VIEWTRANSFORM_DIR_FROM_REFERENCE);
        config->addViewTransform(shown);
        for (const char *display : of.displays)
            if (display)
                config->addDisplayView(display, name.c_str(), name.c_str(),
                                       (std::string(display) + " - Display").c_str(), "", "", "");
    }
    return config;
}

// OpenColorIO would keep all transforms for the life of the configuration, and clients think of as
// many as they like.
OCIO::ConstConfigRcPtr without_cache(const OCIO::ConstConfigRcPtr &config) {
    OCIO::ConfigRcPtr forgetful = config->createEditableCopy();
    forgetful->setProcessorCacheFlags(OCIO::PROCESSOR_CACHE_OFF);
    return forgetful;
}

// Refuses mistakes that OpenColorIO's own validation lets through.
void check(shd_color_config *config, bool archived, std::set<std::string> *files) {
    const OCIO::ConstConfigRcPtr &ocio = config->ocio;
    OCIO::ConstColorSpaceRcPtr linear = ocio->getColorSpace(OCIO::ROLE_SCENE_LINEAR);
    if (!ocio->hasRole(OCIO::ROLE_SCENE_LINEAR) || !linear)
        throw std::runtime_error("the role scene_linear is missing");
    if (linear->isData())
        throw std::runtime_error("the role scene_linear names a data space, which cannot be "
                                 "converted");
    if (!ocio->getNumDisplays()) throw std::runtime_error("there is no display");

    *files = shd_ocio_walk(ocio, archived);
}

// Builds every transform, and keeps it: its files may be others by the time that somebody asks.
void make_all(shd_color_config *config) {
    const shd_catalog &catalog = config->catalog;
    const char *working = catalog.scene_linear->name;
    const shd_color_transform *made;
    shd_error error;
    shd_color_lease **kept = &config->kept;
    for (size_t i = 0; i < catalog.space_count; i++) {
        const char *name = catalog.spaces[i].name;
        if (shd_color_to_space(config, working, name, kept, &made, &error) ||
            shd_color_to_space(config, name, working, kept, &made, &error))
            throw std::runtime_error("color space '" + std::string(name) + "': " + error.text);
    }
    for (size_t i = 0; i < catalog.display_count; i++)
        for (size_t j = 0; j < catalog.displays[i].view_count; j++) {
            const char *display = catalog.displays[i].name, *view = catalog.displays[i].views[j];
            if (shd_color_to_view(config, working, display, view, kept, &made, &error))
                throw std::runtime_error("display '" + std::string(display) + "', view '" + view +
                                         "': " + error.text);
        }
}

// Configurations that OpenColorIO has in itself, which are no files.
bool is_named(const std::string &path) {
    return path.rfind("ocio://", 0) == 0;
}

bool is_archive(const std::string &path) {
    return path.size() > 6 && !path.compare(path.size() - 6, 6, ".ocioz");
}

// What decides on a configuration, but for the files that it refers to.
shd_status read_configuration(const std::string &path, std::string *text, shd_error *error) {
    if (is_named(path)) {
        *text = path; // and OpenColorIO's version, which the digest has anyway
        return SHD_OK;
    }
    char *data = nullptr;
    size_t size = 0;
    const size_t most = is_archive(path) ? max_referenced_bytes : max_config_bytes;
    shd_status status = shd_color_read_file(path.c_str(), most, &data, &size, error);
    if (status) return status;
    std::unique_ptr<char, decltype(&std::free)> owner(data, std::free);
    text->assign(data, size);
    return SHD_OK;
}

std::string folder_of(const std::string &path) {
    size_t slash = path.rfind('/');
    return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

} // namespace

shd_status shd_color_config_load(const char *path, shd_color_config **out, shd_error *error) {
    const char *where = path ? path : "";
    return guarded(SHD_CONFIG, where, error, [&]() -> shd_status {
        quiet_the_process();
        // OpenColorIO allocates in functions that are declared noexcept, and ends the process if
        // there is no memory. So room for an ordinary configuration is asked for beforehand.
        operator delete(operator new(room_to_read));
        const std::string built_in(reinterpret_cast<const char *>(shd_embedded_ocio),
                                   shd_embedded_ocio_size);
        std::string text = what_counts(built_in);
        shd_status status = path ? read_configuration(path, &text, error) : SHD_OK;
        if (status) return status;
        // OpenColorIO remembers files, missing ones included; that would outlive a correction.
        OCIO::ClearAllCaches();
        std::istringstream stream(text);
        const bool archived = path && is_archive(path);
        std::unique_ptr<shd_color_config> config(new shd_color_config);
        config->ocio = archived || (path && is_named(path))
                           ? OCIO::Config::CreateFromFile(path)
                           : OCIO::Config::CreateFromStream(stream);
        std::set<std::string> files;
        if (path) {
            OCIO::ConfigRcPtr editable = config->ocio->createEditableCopy();
            if (!archived) editable->setWorkingDir(folder_of(path).c_str());
            editable->validate();
            lend_spaces(editable, built_in);
            config->ocio = editable;
            check(config.get(), archived, &files);
        } else {
            config->ocio = with_aces_2(config->ocio);
        }
        config->ocio = without_cache(config->ocio);
        fill_catalog(config.get());
        if (path) make_all(config.get());
        status = digest(config.get(), path ? built_in + text : built_in + built_in, files, error);
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

const shd_space_info *shd_color_rule(const shd_color_config *config, const char *name,
                                     bool *is_default) {
    *is_default = true;
    try {
        *is_default = config->ocio->filepathOnlyMatchesDefaultRule(name);
        return shd_catalog_space(&config->catalog, config->ocio->getColorSpaceFromFilepath(name));
    } catch (...) {
        return nullptr;
    }
}
