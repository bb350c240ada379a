/* The microgeometry of Westin materials. */
#include "scene/read.h"

static const char *const types[] = {"grooves", "weave", "heightfield", NULL};

enum {
    GROOVES = 1 << SHD_GROOVES,
    WEAVE = 1 << SHD_WEAVE,
    HEIGHTFIELD = 1 << SHD_HEIGHTFIELD,
    ANY = GROOVES | WEAVE | HEIGHTFIELD
};

/* Steeper grooves, thinner threads and rougher fields have more bounces than tables have terms. */
static const shd_range slopes = {0, 70, false, false, "0 to 70 degrees"},
                       radii = {0.2, 0.5, false, false, "0.2 to 0.5"},
                       roughness = {0, 2, false, false, "0 to 2"};

#define AT(member) offsetof(shd_microgeometry, member)

static const shd_field fields[] = {
    {"type", .read = NULL},
    {"angle", shd_read_degrees, AT(angle), GROOVES, .range = &slopes},
    {"warp", shd_read_number, AT(warp), WEAVE, .range = &radii},
    {"weft", shd_read_number, AT(weft), WEAVE, .range = &radii},
    {"slope", shd_read_number, AT(slope), HEIGHTFIELD, .range = &roughness},
};

void shd_read_microgeometry(shd_reader *r, const shd_node *node, void *out) {
    static const char *const names[] = {"a microgeometry of grooves", "a microgeometry of a weave",
                                        "a microgeometry of a height field"};
    if (!shd_is_object(r, node)) return;
    const shd_node type = shd_node_member(node, "type");
    int kind = -1;
    if (type.value)
        kind = shd_read_name(r, &type, types);
    else
        shd_wrong(r, node, "a microgeometry needs a `type`: grooves, weave or heightfield");
    const bool known = kind >= 0;
    shd_microgeometry micro = {.type = known ? (shd_microgeometry_type)kind : SHD_GROOVES,
                               .angle = kind == SHD_GROOVES ? 45 * (SHD_PI / 180) : 0,
                               .warp = kind == SHD_WEAVE ? 0.45 : 0,
                               .weft = kind == SHD_WEAVE ? 0.45 : 0,
                               .slope = kind == SHD_HEIGHTFIELD ? 0.3 : 0};
    shd_read_fields(r, node, fields, SHD_LENGTH(fields), known ? 1u << kind : ANY,
                    known ? names[kind] : "a microgeometry", &micro);
    shd_microgeometry *kept = shd_take(r, 1, sizeof *kept);
    if (!kept) return;
    *kept = micro;
    *(const shd_microgeometry **)out = kept;
}

void shd_check_facets(shd_reader *r, const shd_node *node, const double diffuse[3]) {
    static const double slack = 1e-9; /* rounding of color conversion */
    for (int c = 0; c < 3; c++) {
        if (!(fabs(diffuse[c]) > 1 + slack)) continue;
        shd_wrong(r, node,
                  "the facets of a westin material light each other: `diffuse` must be at most 1 "
                  "in every channel of the working space, got %.9g",
                  diffuse[c]);
        return;
    }
}

bool shd_same_microgeometry(const shd_microgeometry *a, const shd_microgeometry *b) {
    if (!a || !b) return a == b;
    return a->type == b->type && a->angle == b->angle && a->warp == b->warp && a->weft == b->weft &&
           a->slope == b->slope;
}
