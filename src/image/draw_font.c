#include "image/draw_font.h"

#include <math.h>
#include <string.h>

#include "base/utf8.h"

/* Points of a sign are two characters each: a digit, which is x, and a letter, which is y: D is the
 * base line, K the height of small letters, N that of capitals, A where letters hang down to.
 * A small letter is the control point of a quadratic curve; between two of them the curve passes
 * through their middle, as in TrueType. A space lifts the pen. */
typedef struct sign {
    uint32_t point; /* Unicode */
    int width;
    const char *strokes;
} sign;

static const sign signs[] = {
    {' ', 2, ""},
    {'!', 0, "0N0G 0D0D"},
    {'"', 2, "0N0L 2N2L"},
    {'#', 7, "1D2N 5D6N 0G6G 1K7K"},
    {'$', 6, "6L6n3N0n0K0i3I6i6G6d3D0d0F 3O3C"},
    {'%', 8, "1N0n0M0K0j1J2j2K2M2n1N 7H6h6G6E6d7D8d8E8G8h7H 7N1D"},
    {'&', 6, "6D1K1n3N5n5L5j0G0d2D5d6H"},
    {'\'', 0, "0N0L"},
    {'(', 2, "2O0m0I0e2C"},
    {')', 2, "0O2m2I2e0C"},
    {'*', 4, "2N2I 0M4J 4M0J"},
    {'+', 6, "0H6H 3E3K"},
    {',', 1, "1E0B"},
    {'-', 4, "0H4H"},
    {'.', 0, "0D0D"},
    {'/', 5, "0C5N"},
    {'0', 6, "3N0n0K0G0d3D6d6G6K6n3N"},
    {'1', 6, "1L4N4D"},
    {'2', 6, "0K0n3N6n6K6i0D6D"},
    {'3', 6, "0L0n3N6n6K6i3I6i6G6d3D0d0F"},
    {'4', 6, "5D5N0G6G"},
    {'5', 6, "6N1N0I1j3J6j6G6d3D0d0F"},
    {'6', 6, "5N1l0G0d3D6d6G6j3J0j0G"},
    {'7', 6, "0N6N2D"},
    {'8', 6, "3I0i0K0n3N6n6K6i3I0i0G0d3D6d6G6i3I"},
    {'9', 6, "1D5f6K6n3N0n0K0h3H6h6K"},
    {':', 0, "0D0D 0J0J"},
    {';', 1, "1E0B 1J1J"},
    {'<', 5, "5L0H5D"},
    {'=', 6, "0J6J 0F6F"},
    {'>', 5, "0L5H0D"},
    {'?', 6, "0L0n3N6n6K6i3H3G 3D3D"},
    {'@', 8, "6J4k2J2G4e6G6K 6G7e8G8K8n4N0n0I0d5D"},
    {'A', 6, "0D3N6D 1G5G"},
    {'B', 6, "0D0N3N5n5K5i3I0I 3I6i6G6d3D0D"},
    {'C', 6, "6L6n3N0n0K0G0d3D6d6F"},
    {'D', 6, "0D0N2N6n6J6H6d2D0D"},
    {'E', 6, "6N0N0D6D 0I5I"},
    {'F', 6, "6N0N0D 0I5I"},
    {'G', 6, "6L6n3N0n0K0G0d3D6d6G6I3I"},
    {'H', 6, "0D0N 6D6N 0I6I"},
    {'I', 0, "0D0N"},
    {'J', 4, "4N4G4d2D0d0F"},
    {'K', 6, "0D0N 6N0H 2I6D"},
    {'L', 5, "0N0D5D"},
    {'M', 8, "0D0N4H8N8D"},
    {'N', 6, "0D0N6D6N"},
    {'O', 6, "3N0n0K0G0d3D6d6G6K6n3N"},
    {'P', 6, "0D0N3N6n6K6h3H0H"},
    {'Q', 6, "3N0n0K0G0d3D6d6G6K6n3N 4F6D"},
    {'R', 6, "0D0N3N6n6K6h3H0H 3H6D"},
    {'S', 6, "6L6n3N0n0K0i3I6i6G6d3D0d0F"},
    {'T', 6, "0N6N 3N3D"},
    {'U', 6, "0N0G0d3D6d6G6N"},
    {'V', 6, "0N3D6N"},
    {'W', 8, "0N2D4L6D8N"},
    {'X', 6, "0D6N 0N6D"},
    {'Y', 6, "0N3I6N 3I3D"},
    {'Z', 6, "0N6N0D6D"},
    {'[', 2, "2O0O0C2C"},
    {'\\', 5, "0N5C"},
    {']', 2, "0O2O2C0C"},
    {'^', 4, "0J2N4J"},
    {'_', 6, "0C6C"},
    {'`', 1, "0N1L"},
    {'a', 5, "5K5D 5I5k3K2K0k0I0F0d2D3D5d5F"},
    {'b', 5, "0N0D 0I0k2K3K5k5I5F5d3D2D0d0F"},
    {'c', 5, "5I5k3K2K0k0I0F0d2D3D5d5F"},
    {'d', 5, "5N5D 5I5k3K2K0k0I0F0d2D3D5d5F"},
    {'e', 5, "0H5H5I5k3K2K0k0I0F0d2D3D5d5E"},
    {'f', 3, "3N1n1L1D 0K3K"},
    {'g', 5, "5K5C5a3A2A0a0B 5I5k3K2K0k0I0F0d2D3D5d5F"},
    {'h', 5, "0N0D 0I0k2K3K5k5I5D"},
    {'i', 0, "0D0K 0N0N"},
    {'j', 2, "2K2B2a0A 2N2N"},
    {'k', 4, "0N0D 4K0G 1H4D"},
    {'l', 1, "0N0E0d1D"},
    {'m', 8, "0K0D 0I0k2K4k4I4D 4I4k6K8k8I8D"},
    {'n', 5, "0K0D 0I0k2K3K5k5I5D"},
    {'o', 5, "2K0k0I0F0d2D3D5d5F5I5k3K2K"},
    {'p', 5, "0K0A 0I0k2K3K5k5I5F5d3D2D0d0F"},
    {'q', 5, "5K5A 5I5k3K2K0k0I0F0d2D3D5d5F"},
    {'r', 3, "0K0D 0I0k2K3K"},
    {'s', 5, "5J5k3K2K0k0I0h2H3G5g5F5d3D2D0d0E"},
    {'t', 3, "1M1F1d3D 0K3K"},
    {'u', 5, "0K0F0d2D3D5d5F 5K5D"},
    {'v', 4, "0K2D4K"},
    {'w', 8, "0K2D4J6D8K"},
    {'x', 5, "0K5D 5K0D"},
    {'y', 4, "0K2D 4K1A"},
    {'z', 5, "0K5K0D5D"},
    {'{', 3, "3O1o1M1J1i0I1i1H1E1c3C"},
    {'|', 0, "0C0O"},
    {'}', 3, "0O2o2M2J2i3I2i2H2E2c0C"},
    {'~', 6, "0G0j2I4g6g6J"},
    {0xb0, 2, "1N0n0M0L0k1K2k2L2M2n1N"},       /* degree */
    {0xb1, 6, "0J6J 3G3M 0D6D"},               /* plus or minus */
    {0xb2, 3, "0M0n1N2n3N3m3L0I3I"},           /* to the second */
    {0xb3, 3, "0M0n1N2N3n3M3l1L3l3K3i1I0i0J"}, /* to the third */
    {0xb7, 0, "0H0H"},                         /* middle dot */
    {0xd7, 5, "0E5J 0J5E"},                    /* times */
    {0x394, 6, "0D3N6D0D"},                    /* Delta */
    {0x3b1, 6, "6K4d2D0d0H0k2K4k6D"},          /* alpha */
    {0x3b8, 5, "2N0n0K0G0d2D3D5d5G5K5n3N2N 0I5I"},
    {0x3bb, 5, "0N1n2L5D 3I0D"},
    {0x3bc, 5, "0K0A 0F0d2D3D5d5F 5K5D"},
    {0x3c0, 6, "0K6K 1K1D 5K5D"},
    {0x3c1, 5, "0A0I0k2K3K5k5I5F5d3D2D0d0F"}, /* rho */
    {0x3c3, 6, "6K3K0k0H0d3D5d5G5k3K"},
    {0x3c6, 6, "3K0k0H0d3D6d6H6k3K 3M3A"},
    {0x2013, 5, "0H5H"},        /* dash */
    {0x2014, 8, "0H8H"},        /* long dash */
    {0x2032, 1, "1N0L"},        /* prime */
    {0x2212, 6, "0H6H"},        /* minus */
    {0x2264, 5, "5L0I5F 0D5D"}, /* at most */
    {0x2265, 5, "0L5I0F 0D5D"}, /* at least */
};

static const sign unknown = {0, 6, "0D0N6N6D0D"};

enum { SIGNS = sizeof signs / sizeof signs[0], CAPITAL = 10, SMALL = 7, HANGING = 3, UNITS = 14 };

shd_typeface shd_typeface_of(double size) {
    const double unit = size / UNITS, gap = floor(2.6 * unit + 0.5), stroke = 1.15 * unit;
    const double capital = floor(CAPITAL * unit + 0.5), small = floor(SMALL * unit + 0.5);
    return (shd_typeface){.unit = unit,
                          .capital = capital,
                          .small = small < capital || capital < 1 ? small : capital - 1,
                          .hanging = floor(HANGING * unit + 0.5),
                          .gap = gap > 2 ? gap : 2,
                          .stroke = stroke > 1 ? stroke : 1};
}

static const sign *find_sign(const char **text) {
    uint32_t point;
    const size_t taken = shd_utf8_decode(*text, &point);
    *text += taken ? taken : 1;
    for (int i = 0; taken && i < SIGNS; i++)
        if (signs[i].point == point) return &signs[i];
    return &unknown;
}

/* Pixels above the base line: the marked heights are whole, and what lies between is in
 * proportion. */
static double height_of(const shd_typeface *face, double y) {
    if (y < 0) return y * face->hanging / HANGING;
    if (y <= SMALL) return y * face->small / SMALL;
    return face->small + (y - SMALL) * (face->capital - face->small) / (CAPITAL - SMALL);
}

static void add_point(shd_glyph *out, shd_point p) {
    if (out->count == SHD_GLYPH_POINTS) return;
    out->ends[out->count] = false;
    out->points[out->count++] = p;
}

/* From the last point; six pieces are smooth at any size that a label has. */
static void add_curve(shd_glyph *out, shd_point control, shd_point to) {
    enum { STEPS = 6 };
    const shd_point from = out->points[out->count - 1];
    for (int i = 1; i <= STEPS; i++) {
        const double t = (double)i / STEPS, a = (1 - t) * (1 - t), b = 2 * t * (1 - t), c = t * t;
        add_point(out, (shd_point){a * from.x + b * control.x + c * to.x,
                                   a * from.y + b * control.y + c * to.y});
    }
}

static void add_strokes(const shd_typeface *face, double across, const char *strokes,
                        shd_glyph *out) {
    bool curved = false;
    shd_point control = {0, 0};
    for (const char *s = strokes; *s; s += 2) {
        if (*s == ' ') {
            out->ends[out->count - 1] = true;
            s++;
        }
        const bool off = s[1] >= 'a';
        const shd_point p = {(s[0] - '0') * across, -height_of(face, s[1] - (off ? 'd' : 'D'))};
        if (off && curved)
            add_curve(out, control, (shd_point){(control.x + p.x) / 2, (control.y + p.y) / 2});
        else if (!off && curved)
            add_curve(out, control, p);
        else if (!off)
            add_point(out, p);
        curved = off;
        control = p;
    }
    if (out->count) out->ends[out->count - 1] = true;
}

bool shd_glyph_next(const shd_typeface *face, const char **text, shd_glyph *out) {
    if (!**text) return false;
    const sign *found = find_sign(text);
    const double width = floor(found->width * face->unit + 0.5);
    out->count = 0;
    add_strokes(face, found->width ? width / found->width : 0, found->strokes, out);
    out->advance = width + face->gap;
    return true;
}

double shd_text_width(const char *text, double size) {
    const shd_typeface face = shd_typeface_of(size);
    double width = 0;
    while (*text) {
        const sign *found = find_sign(&text);
        width += floor(found->width * face.unit + 0.5) + face.gap;
    }
    return width > 0 ? width - face.gap + face.stroke : 0;
}
