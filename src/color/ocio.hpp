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

#include "base/budget.h"
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

// Bytes that a budget counts (null: none does) for as long as this is there.
class shd_color_account {
  public:
    shd_color_account() = default;
    shd_color_account(const shd_color_account &) = delete;
    ~shd_color_account();
    // False: it refuses. Again only where that one was null, and nothing was added.
    bool take(shd_budget *from, size_t bytes);
    void add(size_t bytes); // in any case
    size_t bytes() const { return held; }

  private:
    shd_budget *budget = nullptr;
    std::atomic<size_t> held{0};
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

    size_t reckoned = 0;               // bytes that `cpu` takes
    mutable shd_color_account account; // of these and of `codes`
};

using shd_color_shared = std::shared_ptr<const shd_color_transform>;

// Transforms for those who ask next, of all configurations that an engine has had. Those that
// nobody holds go, the longest unused first, where all together take too much. Any thread.
class shd_color_shelf {
  public:
    shd_color_shelf(shd_budget *budget, size_t most); // null: none; bytes of what nobody holds
    ~shd_color_shelf();
    shd_color_shared find(const std::string &key);
    // What is there for `key` now: `made`, or what another thread has put. Null: the budget
    // refuses.
    shd_color_shared put(const std::string &key, shd_color_shared made);
    bool put_all(shd_color_shelf &from);   // false: the budget refuses some of it
    size_t trim(size_t bytes);             // makes that many go, if there are; tells how many went
    void tidy();                           // after something was let go
    void clear(const std::string &prefix); // of keys

  private:
    using Entry = std::pair<std::string, shd_color_shared>;
    size_t take_out(size_t bytes, size_t count, std::list<Entry> *out);
    void take_excess(std::list<Entry> *out);

    shd_budget *const budget;
    const size_t most;
    std::mutex mutex;         // of what follows
    std::list<Entry> entries; // the one that was asked for last in front
    std::map<std::string, std::list<Entry>::iterator> places;
};

struct shd_color_lease {
    std::shared_ptr<shd_color_shelf> shelf;
    std::set<shd_color_shared> held;
    ~shd_color_lease();
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

    std::string number; // what keys begin with: tells its transforms from those of others
    std::shared_ptr<shd_color_shelf> shelf;
    shd_color_lease *kept = nullptr; // of what loading makes
    size_t file_bytes = 0;           // of what it refers to, which OpenColorIO keeps
    shd_color_account account;       // of these

    std::mutex mutex; // of what follows; held while a transform is made
    std::map<std::string, shd_color_info> measured; // by space

    shd_color_config();
    ~shd_color_config();
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
