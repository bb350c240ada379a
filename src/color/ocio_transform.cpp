// Transforms: made on first use, applied to floats.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <new>

#include "base/primaries.h"
#include "color/ocio.hpp"

namespace {

// Pixels that are handed to OpenColorIO at a time; their alphas are kept on the stack meanwhile.
constexpr size_t block = 1024;

// Bytes, more than the making of a transform takes (of tables for PQ: 4 MB).
constexpr size_t room_to_make = 8u << 20;

constexpr size_t each_operator = 4u << 10, each_transform = 8u << 10;

// Leases the transform for `key`; `make` makes it if it is not there yet.
template <typename Make>
shd_status leased(shd_color_config *config, const std::string &key, Make make,
                  shd_color_lease &lease, const shd_color_transform **out, shd_error *error) {
    lease.shelf = config->shelf;
    const std::string place = config->number + key;
    shd_color_shared found = config->shelf->find(place);
    if (!found) {
        std::unique_lock<std::mutex> lock(config->mutex);
        found = config->shelf->find(place);
        if (!found) {
            // As in loading: OpenColorIO ends the process if there is no memory.
            operator delete(operator new(room_to_make));
            shd_color_shared made = make();
            lock.unlock(); // who gives way for it may have locks
            found = config->shelf->put(place, std::move(made));
        }
    }
    if (!found)
        return shd_fail(error, SHD_CROWDED, "",
                        "other requests have the memory just now: the limit `memory` leaves too "
                        "little for a transform of colors");
    *out = lease.held.insert(std::move(found)).first->get();
    return SHD_OK;
}

// Bytes that OpenColorIO takes for these operators: for each what small ones take, measured with
// glibc's malloc, and its tables; of inverted cubes there is a tree beside the table.
size_t reckon(const OCIO::GroupTransform &group) {
    size_t bytes = 0;
    for (int i = 0; i < group.getNumTransforms(); i++) {
        const OCIO::ConstTransformRcPtr one = group.getTransform(i);
        bytes += each_operator;
        if (const auto lut = OCIO_DYNAMIC_POINTER_CAST<const OCIO::Lut1DTransform>(one))
            bytes += sizeof(float[3]) * lut->getLength();
        else if (const auto cube = OCIO_DYNAMIC_POINTER_CAST<const OCIO::Lut3DTransform>(one))
            bytes += (sizeof(float[3]) + sizeof(float[4])) * cube->getGridSize() *
                     cube->getGridSize() * cube->getGridSize();
        else if (const auto more = OCIO_DYNAMIC_POINTER_CAST<const OCIO::GroupTransform>(one))
            bytes += reckon(*more);
    }
    return bytes;
}

// LOSSLESS leaves out the fast approximations of log, exp and pow, and resampled tables.
void build(const OCIO::ConstProcessorRcPtr &processor, shd_color_transform *made) {
    const OCIO::ConstCPUProcessorRcPtr cpu = processor->getOptimizedCPUProcessor(
        OCIO::BIT_DEPTH_F32, OCIO::BIT_DEPTH_F32, OCIO::OPTIMIZATION_LOSSLESS);
    if (cpu->isNoOp()) return;
    made->cpu = cpu;
    made->reckoned += reckon(*processor->createGroupTransform());
}

// What shd_ocio_measure finds of a space. The configuration's mutex is held.
const shd_color_info &measured(shd_color_config *config, const OCIO::ConstColorSpaceRcPtr &space) {
    auto known = config->measured.find(space->getName());
    if (known == config->measured.end()) {
        shd_color_info info{};
        shd_ocio_measure(config->ocio, space, &info);
        known = config->measured.emplace(space->getName(), info).first;
    }
    return known->second;
}

// Whether #rrggbb is sRGB, and numbers are linear Rec.709.
bool css_is_srgb(shd_color_config *config) {
    std::lock_guard<std::mutex> lock(config->mutex);
    const auto is_rec709 = [&](const shd_space_info *space, shd_transfer transfer) {
        const OCIO::ConstColorSpaceRcPtr named = config->ocio->getColorSpace(space->name);
        const shd_color_info &info = measured(config, named);
        return info.transfer == transfer &&
               !std::memcmp(info.primaries, shd_rec709, sizeof shd_rec709);
    };
    return is_rec709(config->catalog.css, SHD_TRANSFER_SRGB) &&
           is_rec709(config->catalog.colors, SHD_TRANSFER_LINEAR);
}

// What the transform's output is: values of `target` or, because nothing happens on the way to
// data, still those of `from`.
void describe(shd_color_config *config, const char *from, const OCIO::ConstColorSpaceRcPtr &target,
              shd_color_transform *made) {
    made->info.name = made->name.c_str();
    if (made->after) {
        made->info.channels = SHD_LCH;
        made->about = made->name + ": " + made->after->description;
        made->info.about = made->about.c_str();
    }
    if (!target || made->after) return;
    made->info.data = target->isData();
    made->info.channels = shd_ocio_channels(target);
    if (made->info.channels != SHD_RGB) {
        made->about = made->name + ": " + shd_ocio_sentence(target->getDescription());
        made->info.about = made->about.c_str();
        if (made->info.channels != SHD_XYZ) return;
    }
    OCIO::ConstColorSpaceRcPtr held = made->info.data ? config->ocio->getColorSpace(from) : target;
    const shd_color_info &known = measured(config, held);
    made->info.transfer = known.transfer;
    made->info.has_primaries = known.has_primaries;
    std::memcpy(made->info.primaries, known.primaries, sizeof made->info.primaries);
}

std::shared_ptr<shd_color_transform> new_transform(const char *name) {
    std::shared_ptr<shd_color_transform> made = std::make_shared<shd_color_transform>();
    made->name = name;
    made->reckoned = each_transform;
    return made;
}

shd_color_shared make_to_space(shd_color_config *config, const char *from, const char *to) {
    const std::shared_ptr<shd_color_transform> made = new_transform(to);
    const bool same = !std::strcmp(from, to);
    if (!same && (made->before = shd_color_find_polar(config, from)))
        from = made->before->base.c_str();
    if (!same && (made->after = shd_color_find_polar(config, to))) to = made->after->base.c_str();
    if (std::strcmp(from, to)) build(config->ocio->getProcessor(from, to), made.get());
    describe(config, from, config->ocio->getColorSpace(to), made.get());
    return made;
}

shd_color_shared make_to_view(shd_color_config *config, const char *from, const char *display,
                              const char *view) {
    const std::shared_ptr<shd_color_transform> made =
        new_transform((std::string(display) + " / " + view).c_str());
    const OCIO::ConstConfigRcPtr &ocio = config->ocio;
    build(ocio->getProcessor(from, display, view, OCIO::TRANSFORM_DIR_FORWARD), made.get());
    made->info.looks = *ocio->getDisplayViewLooks(display, view);
    describe(config, from, shd_ocio_target(ocio, display, view), made.get());
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

} // namespace

static shd_status to_space(shd_color_config *config, const char *from, const char *to,
                           shd_color_lease &lease, const shd_color_transform **out,
                           shd_error *error) {
    const shd_space_info *source = shd_catalog_space(&config->catalog, from);
    if (!source) return unknown(error, "color space", from);
    const shd_space_info *target = shd_catalog_space(&config->catalog, to);
    if (!target) return unknown(error, "color space", to);
    return leased(
        config, std::string(source->name) + '\0' + target->name,
        [&] { return make_to_space(config, source->name, target->name); }, lease, out, error);
}

static shd_color_lease &made_lease(shd_color_lease **lease) {
    if (!*lease) *lease = new shd_color_lease;
    return **lease;
}

shd_status shd_ocio_convert(const void *self, const char *from, const char *to, double rgb[3],
                            shd_error *error) {
    if (!std::strcmp(from, to)) return SHD_OK;
    // The catalog is const for its users; its cache has a mutex.
    auto config = const_cast<shd_color_config *>(static_cast<const shd_color_config *>(self));
    const shd_catalog &catalog = config->catalog;
    bool css = false;
    if (catalog.css && !std::strcmp(from, catalog.css->name)) {
        shd_status status = guarded(SHD_INTERNAL, "", error, [&] {
            css = css_is_srgb(config);
            return SHD_OK;
        });
        if (status) return status;
    }
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
    shd_color_lease lease;
    shd_status status = to_space(config, from, to, lease, &transform, error);
    if (status) return status;
    const bool does = transform->cpu || transform->before || transform->after;
    if (!does && !css) return SHD_OK;
    float pixel[4] = {static_cast<float>(value[0]), static_cast<float>(value[1]),
                      static_cast<float>(value[2]), 1};
    if (does) shd_color_apply(transform, pixel, 1);
    for (int i = 0; i < 3; i++)
        if (!std::isfinite(pixel[i]))
            return shd_fail(error, SHD_SCENE, "", "the color is too large to be converted");
    for (int i = 0; i < 3; i++) rgb[i] = static_cast<double>(pixel[i]);
    return SHD_OK;
}

shd_status shd_color_to_space(shd_color_config *config, const char *from, const char *to,
                              shd_color_lease **lease, const shd_color_transform **out,
                              shd_error *error) {
    return guarded(SHD_INTERNAL, "", error,
                   [&] { return to_space(config, from, to, made_lease(lease), out, error); });
}

shd_status shd_color_to_view(shd_color_config *config, const char *from, const char *display,
                             const char *view, shd_color_lease **lease,
                             const shd_color_transform **out, shd_error *error) {
    const shd_space_info *source = shd_catalog_space(&config->catalog, from);
    if (!source) return unknown(error, "color space", from);
    const shd_display_info *found = shd_catalog_display(&config->catalog, display);
    if (!found) return unknown(error, "display", display);
    bool known = false;
    for (size_t i = 0; i < found->view_count; i++)
        known = known || !std::strcmp(found->views[i], view);
    if (!known) return unknown(error, "view", view);
    return guarded(SHD_INTERNAL, "", error, [&] {
        return leased(
            config, std::string(source->name) + '\0' + display + '\0' + view,
            [&] { return make_to_view(config, source->name, display, view); }, made_lease(lease),
            out, error);
    });
}

// ---- Adjustments. ----

namespace {

void append_looks(const std::string &names, const char *from, OCIO::GroupTransform &way) {
    for (size_t at = 0, end; at < names.size(); at = end + 1) {
        end = std::min(names.find('\n', at), names.size());
        OCIO::LookTransformRcPtr look = OCIO::LookTransform::Create();
        look->setSrc(from);
        look->setDst(from);
        look->setLooks(names.substr(at, end - at).c_str());
        way.appendTransform(look);
    }
}

// Light's exposure and looks, the conversion, then gamma.
shd_color_shared make_adjusted(shd_color_config *config, const char *from, const char *space,
                               const char *display, const char *view, const shd_adjust &adjust) {
    using namespace OCIO;
    const ConstConfigRcPtr &ocio = config->ocio;
    const shd_color_polar *after = view ? nullptr : shd_color_find_polar(config, space);
    GroupTransformRcPtr way = GroupTransform::Create();
    if (adjust.exposure != 0) {
        ExposureContrastTransformRcPtr exposure = ExposureContrastTransform::Create();
        exposure->setStyle(EXPOSURE_CONTRAST_LINEAR);
        exposure->setExposure(adjust.exposure);
        way->appendTransform(exposure);
    }
    if (adjust.looks) append_looks(adjust.looks, from, *way);
    if (view) {
        DisplayViewTransformRcPtr shown = DisplayViewTransform::Create();
        shown->setSrc(from);
        shown->setDisplay(display);
        shown->setView(view);
        shown->setLooksBypass(adjust.looks != nullptr);
        way->appendTransform(shown);
    } else {
        ColorSpaceTransformRcPtr converted = ColorSpaceTransform::Create();
        converted->setSrc(from);
        converted->setDst(after ? after->base.c_str() : space);
        way->appendTransform(converted);
    }
    if (adjust.gamma != 1) {
        ExponentTransformRcPtr gamma = ExponentTransform::Create();
        const double power = 1 / adjust.gamma, powers[] = {power, power, power, 1};
        gamma->setValue(powers);
        gamma->setNegativeStyle(NEGATIVE_MIRROR);
        way->appendTransform(gamma);
    }
    const std::shared_ptr<shd_color_transform> made =
        new_transform(view ? (std::string(display) + " / " + view).c_str() : space);
    build(ocio->getProcessor(way), made.get());
    made->after = after;
    made->info.looks =
        adjust.looks ? *adjust.looks : view && *ocio->getDisplayViewLooks(display, view);
    describe(config, from, view ? shd_ocio_target(ocio, display, view) : ocio->getColorSpace(space),
             made.get());
    return made;
}

} // namespace

shd_status shd_color_adjusted(shd_color_config *config, const char *from, const char *space,
                              const char *display, const char *view, const shd_adjust *adjust,
                              shd_color_lease **lease, const shd_color_transform **out,
                              shd_error *error) {
    return guarded(SHD_INTERNAL, "", error, [&] {
        char numbers[64];
        snprintf(numbers, sizeof numbers, "%a %a ", adjust->exposure, adjust->gamma);
        const std::string key = numbers + std::string(from) + '\0' + (view ? display : space) +
                                '\0' + (view ? view : "") + '\0' +
                                (adjust->looks ? adjust->looks : "\n");
        return leased(
            config, key, [&] { return make_adjusted(config, from, space, display, view, *adjust); },
            made_lease(lease), out, error);
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

namespace {

void apply_processor(const shd_color_transform *transform, float *rgba, size_t count) {
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

} // namespace

void shd_color_apply(const shd_color_transform *transform, float *rgba, size_t count) {
    if (transform->before) shd_color_from_polar(*transform->before, rgba, count);
    if (transform->cpu) apply_processor(transform, rgba, count);
    if (transform->after) shd_color_to_polar(*transform->after, rgba, count);
}

bool shd_color_mixes(const shd_color_transform *transform) {
    try {
        return transform->before || transform->after ||
               (transform->cpu && transform->cpu->hasChannelCrosstalk());
    } catch (...) {
        return true;
    }
}
