// What the C++ files of OpenColorIO share. Inside of color/.
#pragma once

#include <OpenColorIO/OpenColorIO.h>

#include <atomic>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "color/codes.h"
#include "color/color.h"

namespace OCIO = OCIO_NAMESPACE;

// Lightness, chroma and hue of a space that has lightness and two axes: L, the length and the angle
// of (a, b), each times a scale. OpenColorIO has no operator for an angle, so this is ours.
struct shd_color_polar {
    std::string name, description, base;
    std::vector<const char *> aliases;
    double scale[3]; // of L, C, and h in degrees
};

struct shd_color_transform {
    OCIO::ConstCPUProcessorRcPtr cpu;                          // null: OpenColorIO does nothing
    const shd_color_polar *before = nullptr, *after = nullptr; // null: none
    shd_color_info info{};
    std::string name, about;

    // Of 8 and 16 bits; null also if baking failed.
    struct Codes {
        struct Drop {
            void operator()(shd_color_codes *table) const { shd_color_codes_drop(table); }
        };
        std::atomic<size_t> asked{0}; // pixels
        std::atomic<bool> done{false};
        std::mutex baking;
        std::unique_ptr<shd_color_codes, Drop> baked; // constant once it is done
    };
    mutable Codes codes[2];
};

struct shd_color_lease {
    std::set<std::shared_ptr<const shd_color_transform>> held;
};

struct shd_color_config {
    OCIO::ConstConfigRcPtr ocio;
    std::string digest;

    // The catalog and what it points into; constant once loaded.
    shd_catalog catalog{};
    std::deque<std::string> texts;
    std::vector<shd_space_info> spaces;
    std::deque<shd_color_polar> polar;
    std::vector<shd_display_info> displays;
    std::deque<std::vector<const char *>> views, aliases;
    std::vector<shd_look_info> looks;
    std::deque<std::vector<shd_holds>> holds;

    std::mutex mutex; // guards what follows, not what transforms point to
    std::map<std::string, std::unique_ptr<shd_color_transform>> transforms;
    std::map<std::string, shd_color_info> measured; // by space

    // Those with adjustments, the one that was asked for last in front.
    std::list<std::pair<std::string, std::shared_ptr<shd_color_transform>>> adjusted;
};

// Makes one line of text, without a trailing period. Bytes that are no text become question marks.
std::string shd_ocio_sentence(const char *text);

// Runs `body` and turns whatever it throws into `status`, and whatever telling of that throws.
template <typename Body>
shd_status guarded(shd_status status, const char *path, shd_error *error, Body body) {
    try {
        try {
            return body();
        } catch (const std::bad_alloc &) {
            throw;
        } catch (const std::exception &e) {
            return shd_fail(error, status, path, "%s", shd_ocio_sentence(e.what()).c_str());
        }
    } catch (const std::bad_alloc &) {
        return shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    } catch (...) {
        return shd_fail(error, status, path, "OpenColorIO failed without a reason");
    }
}

// The spaces that clients may name: the active ones, and those that roles name although they are
// not.
std::vector<OCIO::ConstColorSpaceRcPtr> shd_ocio_spaces(const OCIO::ConstConfigRcPtr &config);

// Visits everything that these spaces, the active displays and views refer to, and returns the
// files among that. OpenColorIO follows references by recursion without an end and opens any path,
// so this refuses circles, chains that are too deep and files that are not regular before a
// processor is built. `archived`: the files are in the configuration's own archive.
std::set<std::string> shd_ocio_walk(const OCIO::ConstConfigRcPtr &config, bool archived);

// Finds the transfer and the primaries of an RGB space that is no data, as far as the roles
// aces_interchange and cie_xyz_d65_interchange tell. Others are left as they are.
void shd_ocio_measure(const OCIO::ConstConfigRcPtr &ocio, const OCIO::ConstColorSpaceRcPtr &space,
                      shd_color_info *info);

// The space whose values a view holds; null: there is none.
OCIO::ConstColorSpaceRcPtr shd_ocio_target(const OCIO::ConstConfigRcPtr &ocio, const char *display,
                                           const char *view);

// The spaces of this kind whose base is there. Null: `name` is none.
void shd_color_add_polar(shd_color_config *config);
const shd_color_polar *shd_color_find_polar(const shd_color_config *config, const char *name);

// In place, RGBA pixels.
void shd_color_to_polar(const shd_color_polar &polar, float *rgba, size_t count);
void shd_color_from_polar(const shd_color_polar &polar, float *rgba, size_t count);

shd_channels shd_ocio_channels(const OCIO::ConstColorSpaceRcPtr &space);
bool shd_ocio_is_linear(const OCIO::ConstColorSpaceRcPtr &space);

// shd_catalog.convert of a configuration.
shd_status shd_ocio_convert(const void *self, const char *from, const char *to, double rgb[3],
                            shd_error *error);
