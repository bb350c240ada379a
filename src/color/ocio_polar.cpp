// Lightness, chroma and hue: CIE 15:2004, 8.2.3, of CIELAB, and the same of OKLab. No operator of
// OpenColorIO 2.1 gives the angle of two channels: RGB_TO_HSV has a hexagon's hue, up to 1.1
// degrees beside it, and a hexagon's chroma, whose correction would be a product of functions of
// two channels. So OpenColorIO makes lightness and the axes, and what follows is done here.

#include <cmath>
#include <cstring>

#include "color/ocio.hpp"

namespace {

constexpr double degrees = 57.295779513082320877;

// As wide an error as floats leave to the axes of a grey, over the white's lightness: less chroma
// than that is none.
constexpr double least = 3e-6;

struct Kind {
    const char *base, *name, *alias;
    double white;      // lightness
    const char *about; // of floats
    double stored[3];  // scales of integers
    const char *told;
};

const Kind kinds[] = {
    {"CIELAB D50",
     "LCh D50",
     "LCh",
     100,
     "CIE 1976 L*, chroma and hue of the white D50. L* from 0 to 100, hue in degrees",
     {1 / 100.0, 1 / 255.0, 1 / 360.0},
     "LCh D50 as integers of any depth hold it: L*/100, C*/255, h/360"},
    {"CIELAB D65",
     "LCh D65",
     nullptr,
     100,
     "CIE 1976 L*, chroma and hue of the white D65. L* from 0 to 100, hue in degrees",
     {1 / 100.0, 1 / 255.0, 1 / 360.0},
     "LCh D65 as integers of any depth hold it: L*/100, C*/255, h/360"},
    {"OKLab",
     "OKLCh",
     nullptr,
     1,
     "Ottosson's L, chroma and hue, white D65. L of white is 1, hue in degrees",
     {1, 127 / (255 * 0.4), 1 / 360.0},
     "OKLCh as integers of any depth hold it: L, C (127/255)/0.4, h/360"}};

double white_of(const shd_color_polar &polar) {
    for (const Kind &kind : kinds)
        if (polar.base == kind.base) return kind.white;
    return 1;
}

} // namespace

void shd_color_add_polar(shd_color_config *config) {
    for (const Kind &kind : kinds) {
        OCIO::ConstColorSpaceRcPtr base = config->ocio->getColorSpace(kind.base);
        if (!base || shd_ocio_channels(base) != SHD_LAB) continue;
        const std::string file = std::string(kind.name) + " file";
        if (config->ocio->getColorSpace(kind.name) || config->ocio->getColorSpace(file.c_str()))
            continue;
        shd_color_polar plain{kind.name, kind.about, kind.base, {}, {1, 1, 1}};
        if (kind.alias && !config->ocio->getColorSpace(kind.alias))
            plain.aliases.push_back(kind.alias);
        config->polar.push_back(plain);
        shd_color_polar stored{file, kind.told, kind.base, {}, {}};
        std::memcpy(stored.scale, kind.stored, sizeof stored.scale);
        config->polar.push_back(stored);
    }
}

const shd_color_polar *shd_color_find_polar(const shd_color_config *config, const char *name) {
    for (const shd_color_polar &polar : config->polar)
        if (polar.name == name) return &polar;
    return nullptr;
}

void shd_color_to_polar(const shd_color_polar &polar, float *rgba, size_t count) {
    const double none = least * white_of(polar);
    for (float *v = rgba; v < rgba + 4 * count; v += 4) {
        const double a = static_cast<double>(v[1]), b = static_cast<double>(v[2]);
        double chroma = std::hypot(a, b), hue = std::atan2(b, a) * degrees;
        if (chroma < none) chroma = hue = 0;
        if (hue < 0) hue += 360;
        if (static_cast<float>(hue) >= 360) hue = 0;
        v[0] = static_cast<float>(static_cast<double>(v[0]) * polar.scale[0]);
        v[1] = static_cast<float>(chroma * polar.scale[1]);
        v[2] = static_cast<float>(hue * polar.scale[2]);
    }
}

void shd_color_from_polar(const shd_color_polar &polar, float *rgba, size_t count) {
    for (float *v = rgba; v < rgba + 4 * count; v += 4) {
        const double chroma = static_cast<double>(v[1]) / polar.scale[1];
        const double hue = static_cast<double>(v[2]) / polar.scale[2] / degrees;
        v[0] = static_cast<float>(static_cast<double>(v[0]) / polar.scale[0]);
        v[1] = static_cast<float>(chroma * std::cos(hue));
        v[2] = static_cast<float>(chroma * std::sin(hue));
    }
}
