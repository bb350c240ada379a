// What an encoding is, its primaries and its curve, found by converting a few colors to CIE XYZ.
// OpenColorIO knows how to convert, but not what a file should declare.

#include <cmath>
#include <cstring>

#include "base/primaries.h"
#include "color/ocio.hpp"

namespace {

const double ramp[] = {0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95};
const double mixed[][3] = {{0.8, 0.3, 0.1}, {0.1, 0.6, 0.9}, {0.35, 0.05, 0.65}};
enum {
    BLACK,
    WHITE,
    RED,
    RAMP = RED + 3,
    MIXED = RAMP + sizeof ramp / sizeof *ramp,
    PROBES = MIXED + sizeof mixed / sizeof *mixed
};

// CIE XYZ of the probes under D65; Y of white is 1.
struct Probes {
    double xyz[PROBES][3];
};

// To XYZ under D65: of the scene's spaces through ACES2065-1, because the way to the displays'
// reference may have a tone scale; of displays' spaces by their role. Null: the role is missing.
OCIO::ConstProcessorRcPtr way_to_xyz(const OCIO::ConstConfigRcPtr &ocio,
                                     const OCIO::ConstColorSpaceRcPtr &space) {
    static const char scene[] = "aces_interchange", display[] = "cie_xyz_d65_interchange";
    if (space->getReferenceSpaceType() == OCIO::REFERENCE_SPACE_SCENE && ocio->hasRole(scene)) {
        OCIO::ColorSpaceTransformRcPtr to_aces = OCIO::ColorSpaceTransform::Create();
        to_aces->setSrc(space->getName());
        to_aces->setDst(scene);
        OCIO::BuiltinTransformRcPtr to_xyz = OCIO::BuiltinTransform::Create();
        to_xyz->setStyle("UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD");
        OCIO::GroupTransformRcPtr way = OCIO::GroupTransform::Create();
        way->appendTransform(to_aces);
        way->appendTransform(to_xyz);
        return ocio->getProcessor(way);
    }
    return ocio->hasRole(display) ? ocio->getProcessor(space->getName(), display) : nullptr;
}

// False: white is dark, or black is not.
bool convert_probes(const OCIO::ConstProcessorRcPtr &way, Probes *out) {
    OCIO::ConstCPUProcessorRcPtr cpu = way->getOptimizedCPUProcessor(
        OCIO::BIT_DEPTH_F32, OCIO::BIT_DEPTH_F32, OCIO::OPTIMIZATION_LOSSLESS);
    float rgb[PROBES][3] = {};
    for (int i = 0; i < 3; i++) rgb[WHITE][i] = rgb[RED + i][i] = 1;
    for (int i = RAMP; i < PROBES; i++)
        for (int c = 0; c < 3; c++)
            rgb[i][c] = static_cast<float>(i < MIXED ? ramp[i - RAMP] : mixed[i - MIXED][c]);
    for (float *pixel : rgb) cpu->applyRGB(pixel);
    const double white = static_cast<double>(rgb[WHITE][1]);
    if (!(white > 1e-6)) return false;
    for (int i = 0; i < PROBES; i++)
        for (int c = 0; c < 3; c++) {
            out->xyz[i][c] = static_cast<double>(rgb[i][c]) / white;
            if (!std::isfinite(out->xyz[i][c])) return false;
        }
    return std::fabs(out->xyz[BLACK][1]) < 1e-4;
}

// HLG's displays raise the scene's luminance to the power of 1.2 (BT.2100, at 1000 cd/m2).
Probes before_display(const Probes &probes) {
    Probes out = probes;
    for (double *xyz : out.xyz) {
        const double gain = xyz[1] > 0 ? std::pow(xyz[1], 1 / 1.2 - 1) : 1;
        for (int c = 0; c < 3; c++) xyz[c] *= gain;
    }
    return out;
}

// Whether greys follow the curve, to a quarter of a code of 8 bits (OpenColorIO's own sRGB
// is 2.5e-4 off), and mixed colors are what primaries and curve make of them.
bool follows(const Probes &probes, shd_transfer curve) {
    for (int i = RAMP; i < MIXED; i++)
        if (!(std::fabs(shd_curve_encode(curve, probes.xyz[i][1]) - ramp[i - RAMP]) < 1e-3))
            return false;
    for (int i = MIXED; i < PROBES; i++)
        for (int row = 0; row < 3; row++) {
            double sum = 0;
            for (int c = 0; c < 3; c++)
                sum += probes.xyz[RED + c][row] * shd_curve_decode(curve, mixed[i - MIXED][c]);
            if (!(std::fabs(sum - probes.xyz[i][row]) < 2e-3)) return false;
        }
    return true;
}

// OpenColorIO adapts other whites to D65 by Bradford: the primaries are those that come out alike.
bool are_primaries(const Probes &probes, const double xy[8]) {
    shd_affine adapt, rgb;
    const shd_vec3 d65 = {0.3127 / 0.3290, 1, (1 - 0.3127 - 0.3290) / 0.3290};
    if (!shd_primaries_adapt(xy, d65, &adapt, &rgb)) return false;
    for (int row = 0; row < 3; row++)
        for (int c = 0; c < 3; c++)
            if (!(std::fabs(rgb.linear[row][c] - probes.xyz[RED + c][row]) < 1e-3)) return false;
    return true;
}

bool find_primaries(const Probes &probes, double out[8]) {
    static const double *const known[] = {shd_rec709, shd_display_p3, shd_rec2020,   shd_p3_dci,
                                          shd_p3_d60, shd_acescg,     shd_aces2065_1};
    for (const double *xy : known)
        if (are_primaries(probes, xy)) {
            std::memcpy(out, xy, 8 * sizeof *out);
            return true;
        }
    static const int corner[] = {RED, RED + 1, RED + 2, WHITE};
    for (int i = 0; i < 4; i++) {
        const double *xyz = probes.xyz[corner[i]], sum = xyz[0] + xyz[1] + xyz[2];
        if (!(sum > 1e-6)) return false;
        out[2 * i] = xyz[0] / sum;
        out[2 * i + 1] = xyz[1] / sum;
    }
    double unused[3][3];
    return shd_primaries_to_xyz(out, unused);
}

} // namespace

void shd_ocio_measure(const OCIO::ConstConfigRcPtr &ocio, const OCIO::ConstColorSpaceRcPtr &space,
                      shd_color_info *info) {
    static const shd_transfer curves[] = {
        SHD_TRANSFER_LINEAR,  SHD_TRANSFER_SRGB, SHD_TRANSFER_REC1886, SHD_TRANSFER_GAMMA22,
        SHD_TRANSFER_GAMMA26, SHD_TRANSFER_PQ,   SHD_TRANSFER_HLG};
    if (shd_ocio_is_linear(space)) info->transfer = SHD_TRANSFER_LINEAR;
    OCIO::ConstProcessorRcPtr way = way_to_xyz(ocio, space);
    Probes probes;
    if (!way || !convert_probes(way, &probes)) return;
    for (shd_transfer curve : curves) {
        const Probes seen = curve == SHD_TRANSFER_HLG ? before_display(probes) : probes;
        if (!follows(seen, curve)) continue;
        info->has_primaries = find_primaries(seen, info->primaries);
        if (info->has_primaries) info->transfer = curve;
        return;
    }
}
