// Configurations: OpenColorIO's process-wide habits, loading, the catalog.

#include <strings.h>
#include <unistd.h>
#include <xxhash.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>

#include "base/primaries.h"
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

void fill_catalog(shd_color_config *config) {
    const OCIO::ConstConfigRcPtr &ocio = config->ocio;
    OCIO::ConstColorSpaceRcPtr linear = ocio->getColorSpace(OCIO::ROLE_SCENE_LINEAR);
    std::vector<OCIO::ConstColorSpaceRcPtr> of_roles;
    for (int i = 0; i < ocio->getNumRoles(); i++)
        of_roles.push_back(ocio->getColorSpace(ocio->getRoleName(i)));
    for (const OCIO::ConstColorSpaceRcPtr &space : shd_ocio_spaces(ocio))
        fill_space(config, space, space == linear, of_roles);
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
    shd_catalog &catalog = config->catalog;
    catalog.spaces = config->spaces.data();
    catalog.space_count = config->spaces.size();
    for (shd_space_info &space : config->spaces)
        if (space.channels == SHD_YIQ)
            space.file = shd_catalog_space(&catalog, (std::string(space.name) + " file").c_str());
    catalog.displays = config->displays.data();
    catalog.display_count = config->displays.size();
    catalog.scene_linear = shd_catalog_space(&catalog, linear->getName());
    catalog.colors = first_of(catalog, {"lin_rec709", "lin_rec709_srgb", "lin_srgb",
                                        "Linear Rec.709 (sRGB)", linear->getName()});
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

// Refuses mistakes that OpenColorIO's own validation lets through, and builds every processor once.
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
    fill_catalog(config);
    const shd_catalog &catalog = config->catalog;
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

// Whether a space that was measured is that.
bool is_rec709(const shd_color_config *config, const shd_space_info *space, shd_transfer transfer) {
    auto found = config->measured.find(space->name);
    return found != config->measured.end() && found->second.transfer == transfer &&
           !std::memcmp(found->second.primaries, shd_rec709, sizeof shd_rec709);
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
        std::string text = built_in;
        shd_status status = path ? read_configuration(path, &text, error) : SHD_OK;
        if (status) return status;
        // OpenColorIO remembers files, missing ones included; that would outlive a correction.
        OCIO::ClearAllCaches();
        std::istringstream stream(text);
        const bool archived = path && is_archive(path);
        OCIO::ConfigRcPtr editable =
            (archived || (path && is_named(path)) ? OCIO::Config::CreateFromFile(path)
                                                  : OCIO::Config::CreateFromStream(stream))
                ->createEditableCopy();
        if (path && !archived) editable->setWorkingDir(folder_of(path).c_str());
        editable->validate();
        if (path) lend_spaces(editable, built_in);

        std::unique_ptr<shd_color_config> config(new shd_color_config);
        config->ocio = editable;
        std::set<std::string> files;
        check(config.get(), archived, &files);
        const shd_catalog &catalog = config->catalog;
        config->css_is_srgb = catalog.css &&
                              is_rec709(config.get(), catalog.css, SHD_TRANSFER_SRGB) &&
                              is_rec709(config.get(), catalog.colors, SHD_TRANSFER_LINEAR);
        status = digest(config.get(), built_in + text, files, error);
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
