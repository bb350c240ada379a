// What is kept of transforms, and what that takes.

#include "color/ocio.hpp"

namespace {

// More than displays and views of a configuration are, and few enough to be summed for each
// request.
constexpr size_t most_transforms = 256;
constexpr size_t most_bytes = 64u << 20;

} // namespace

// ---- Accounts ----

shd_color_account::~shd_color_account() {
    shd_budget_give(budget, held);
    shd_budget_drop(budget);
}

bool shd_color_account::take(shd_budget *from, size_t bytes) {
    if (!shd_budget_take(from, bytes)) return false;
    budget = shd_budget_keep(from);
    held = bytes;
    return true;
}

void shd_color_account::add(size_t bytes) {
    shd_budget_count(budget, bytes);
    held += bytes;
}

// ---- The shelf. What goes is destroyed when the mutex is free again. ----

shd_color_shelf::shd_color_shelf(shd_budget *of, size_t bytes)
    : budget(shd_budget_keep(of)), most(bytes) {}

shd_color_shelf::~shd_color_shelf() {
    shd_budget_drop(budget);
}

// The mutex is held. Bytes that went: of what nobody holds, until there are so many, and no more
// than `count` transforms left.
size_t shd_color_shelf::take_out(size_t bytes, size_t count, std::list<Entry> *out) {
    size_t gone = 0;
    for (auto at = entries.end();
         at != entries.begin() && (gone < bytes || entries.size() > count);) {
        --at;
        if (at->second.use_count() > 1) continue;
        gone += at->second->account.bytes();
        places.erase(at->first);
        const auto next = std::next(at);
        out->splice(out->end(), entries, at);
        at = next;
    }
    return gone;
}

void shd_color_shelf::take_excess(std::list<Entry> *out) {
    size_t all = 0;
    for (const Entry &entry : entries)
        if (entry.second.use_count() == 1) all += entry.second->account.bytes();
    take_out(all > most ? all - most : 0, most_transforms, out);
}

shd_color_shared shd_color_shelf::find(const std::string &key) {
    std::lock_guard<std::mutex> lock(mutex);
    const auto place = places.find(key);
    if (place == places.end()) return nullptr;
    entries.splice(entries.begin(), entries, place->second);
    return place->second->second;
}

shd_color_shared shd_color_shelf::put(const std::string &key, shd_color_shared made) {
    if (!made->account.take(budget, made->reckoned)) return nullptr;
    std::list<Entry> out;
    std::lock_guard<std::mutex> lock(mutex);
    const auto place = places.find(key);
    if (place != places.end()) return place->second->second;
    entries.emplace_front(key, made);
    try {
        places.emplace(key, entries.begin());
    } catch (...) {
        entries.pop_front();
        throw;
    }
    take_excess(&out);
    return made;
}

bool shd_color_shelf::put_all(shd_color_shelf &from) {
    for (const Entry &entry : from.entries)
        if (!put(entry.first, entry.second)) return false;
    return true;
}

size_t shd_color_shelf::trim(size_t bytes) {
    std::list<Entry> out;
    std::lock_guard<std::mutex> lock(mutex);
    return take_out(bytes, SIZE_MAX, &out);
}

void shd_color_shelf::tidy() {
    std::list<Entry> out;
    std::lock_guard<std::mutex> lock(mutex);
    take_excess(&out);
}

void shd_color_shelf::clear(const std::string &prefix) {
    std::list<Entry> out;
    std::lock_guard<std::mutex> lock(mutex);
    for (auto at = entries.begin(); at != entries.end();) {
        const auto next = std::next(at);
        if (!at->first.compare(0, prefix.size(), prefix)) {
            places.erase(at->first);
            out.splice(out.end(), entries, at);
        }
        at = next;
    }
}

shd_color_lease::~shd_color_lease() {
    held.clear();
    if (shelf) shelf->tidy();
}

void shd_color_lease_drop(shd_color_lease *lease) {
    delete lease;
}

// ---- Configurations ----

shd_color_config::shd_color_config() : shelf(std::make_shared<shd_color_shelf>(nullptr, 0)) {
    static std::atomic<unsigned> made{0};
    number = std::to_string(made++) + ' ';
}

shd_color_config::~shd_color_config() {
    delete kept;
    shelf->clear(number);
}

shd_status shd_color_config_join(shd_color_config *config, shd_budget *budget,
                                 const shd_color_config *first, shd_error *error) {
    return guarded(SHD_CONFIG, "", error, [&] {
        const uint64_t share = shd_budget_most(budget) / 16;
        const std::shared_ptr<shd_color_shelf> loading = config->shelf;
        config->shelf = first ? first->shelf
                              : std::make_shared<shd_color_shelf>(
                                    budget, share < most_bytes ? share : most_bytes);
        if (config->kept) config->kept->shelf = config->shelf;
        if (config->shelf->put_all(*loading) && config->account.take(budget, config->file_bytes))
            return SHD_OK;
        return shd_fail(error, SHD_CONFIG, "",
                        "its transforms and files do not fit into what `memory` leaves");
    });
}

size_t shd_color_trim(shd_color_config *config, size_t bytes) {
    return config->shelf->trim(bytes);
}
