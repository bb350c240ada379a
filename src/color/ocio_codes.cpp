// Transforms baked to codes, once they are asked for enough of them.

#include <algorithm>

#include "color/codes.h"
#include "color/ocio.hpp"

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
            if (codes.baked) transform->account.add(shd_color_codes_size(codes.baked.get()));
            codes.done = codes.baked || !go_on || go_on(context);
        }
    }
    return codes.done ? codes.baked.get() : nullptr;
}
