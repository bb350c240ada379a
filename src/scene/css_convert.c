/* Colors of CSS to linear sRGB. Matrices and curves are those of CSS Color Module Level 4, "Sample
 * code for Color Conversions". rec2020 has a gamma of 2.4, as that text has it since the
 * resolution on issue 12574 of csswg-drafts (2025). Before, it had the camera's curve of BT.2020,
 * which browsers may still show. */
#include <math.h>
#include <string.h>

#include "base/transfer.h"
#include "scene/css.h"

typedef double matrix[3][3];

static const matrix xyz_to_srgb = {{12831.0 / 3959, -329.0 / 214, -1974.0 / 3959},
                                   {-851781.0 / 878810, 1648619.0 / 878810, 36519.0 / 878810},
                                   {705.0 / 12673, -2585.0 / 12673, 705.0 / 667}};

static const matrix p3_to_xyz = {{608311.0 / 1250200, 189793.0 / 714400, 198249.0 / 1000160},
                                 {35783.0 / 156275, 247089.0 / 357200, 198249.0 / 2500400},
                                 {0, 32229.0 / 714400, 5220557.0 / 5000800}};

static const matrix a98_to_xyz = {{573536.0 / 994567, 263643.0 / 1420810, 187206.0 / 994567},
                                  {591459.0 / 1989134, 6239551.0 / 9945670, 374412.0 / 4972835},
                                  {53769.0 / 1989134, 351524.0 / 4972835, 4929758.0 / 4972835}};

static const matrix rec2020_to_xyz = {
    {63426534.0 / 99577255, 20160776.0 / 139408157, 47086771.0 / 278816314},
    {26158966.0 / 99577255, 472592308.0 / 697040785, 8267143.0 / 139408157},
    {0, 19567812.0 / 697040785, 295819943.0 / 278816314}};

/* To D50, as the three that follow. */
static const matrix prophoto_to_xyz = {
    {0.79776664490064230, 0.13518129740053308, 0.03134773412839220},
    {0.28807482881940130, 0.71183523424187300, 0.00008993693872564},
    {0, 0, 0.82510460251046020}};

static const double d50[3] = {0.3457 / 0.3585, 1, (1 - 0.3457 - 0.3585) / 0.3585};

/* Bradford's adaptation of D50 to D65. */
static const matrix d50_to_d65 = {{0.955473421488075, -0.02309845494876471, 0.06325924320057072},
                                  {-0.0283697093338637, 1.0099953980813041, 0.021041441191917323},
                                  {0.012314014864481998, -0.020507649298898964, 1.330365926242124}};

static const matrix oklab_to_lms = {{1, 0.3963377773761749, 0.2158037573099136},
                                    {1, -0.1055613458156586, -0.0638541728258133},
                                    {1, -0.0894841775298119, -1.2914855480194092}};

static const matrix lms_to_xyz = {{1.2268798758459243, -0.5578149944602171, 0.2813910456659647},
                                  {-0.0405757452148008, 1.1122868032803170, -0.0717110580655164},
                                  {-0.0763729366746601, -0.4214933324022432, 1.5869240198367816}};

static void apply_matrix(const matrix m, double v[3]) {
    const double in[3] = {v[0], v[1], v[2]};
    for (int row = 0; row < 3; row++)
        v[row] = m[row][0] * in[0] + m[row][1] * in[1] + m[row][2] * in[2];
}

/* All curves are odd: what is negative is mirrored. */
static double decode(shd_css_space space, double v) {
    const double size = fabs(v);
    switch (space) {
    case SHD_CSS_SRGB:
    case SHD_CSS_DISPLAY_P3:
        return shd_curve_decode(SHD_TRANSFER_SRGB, v);
    case SHD_CSS_A98_RGB:
        return copysign(pow(size, 563.0 / 256), v);
    case SHD_CSS_PROPHOTO_RGB:
        return size <= 16.0 / 512 ? v / 16 : copysign(pow(size, 1.8), v);
    case SHD_CSS_REC2020:
        return copysign(pow(size, 2.4), v);
    default:
        return v;
    }
}

/* CIE 15:2004: L* in 0 to 100, to XYZ of D50. */
static void decode_lab(double v[3]) {
    const double kappa = 24389.0 / 27, epsilon = 216.0 / 24389;
    const double y = (v[0] + 16) / 116, f[3] = {v[1] / 500 + y, y, y - v[2] / 200};
    for (int i = 0; i < 3; i++) {
        const double cube = f[i] * f[i] * f[i];
        v[i] = d50[i] * (cube > epsilon ? cube : (116 * f[i] - 16) / kappa);
    }
}

static void decode_oklab(double v[3]) {
    apply_matrix(oklab_to_lms, v);
    for (int i = 0; i < 3; i++) v[i] = v[i] * v[i] * v[i];
    apply_matrix(lms_to_xyz, v);
}

/* Components that are linear, or Lab's, to XYZ of D65. */
static void find_xyz(shd_css_space space, double v[3]) {
    if (space == SHD_CSS_DISPLAY_P3 || space == SHD_CSS_DISPLAY_P3_LINEAR)
        apply_matrix(p3_to_xyz, v);
    else if (space == SHD_CSS_A98_RGB)
        apply_matrix(a98_to_xyz, v);
    else if (space == SHD_CSS_REC2020)
        apply_matrix(rec2020_to_xyz, v);
    else if (space == SHD_CSS_PROPHOTO_RGB)
        apply_matrix(prophoto_to_xyz, v);
    else if (space == SHD_CSS_LAB)
        decode_lab(v);
    else if (space == SHD_CSS_OKLAB)
        decode_oklab(v);
    if (space == SHD_CSS_PROPHOTO_RGB || space == SHD_CSS_LAB || space == SHD_CSS_XYZ_D50)
        apply_matrix(d50_to_d65, v);
}

void shd_css_convert(shd_css_space space, const double components[3], shd_css_color *out) {
    double v[3];
    memcpy(v, components, sizeof v);
    out->linear = space != SHD_CSS_SRGB || v[0] < 0 || v[1] < 0 || v[2] < 0;
    for (int i = 0; i < 3 && out->linear; i++) v[i] = decode(space, v[i]);
    if (space != SHD_CSS_SRGB && space != SHD_CSS_SRGB_LINEAR) {
        find_xyz(space, v);
        apply_matrix(xyz_to_srgb, v);
    }
    memcpy(out->rgb, v, sizeof v);
}
