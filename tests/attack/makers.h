/* What writes the documents of families. Inside of tests/attack/. */
#ifndef SHD_ATTACK_MAKERS_H
#define SHD_ATTACK_MAKERS_H

#include "attack/scenes.h"

/* A family's document whose member `accuracy` is the text. */
typedef void maker(FILE *out, uint64_t *random, const char *accuracy);

/* scenes_surfaces.c */
maker write_plain, write_many, write_coarse, write_sharp, write_needles, write_stretched,
    write_faceted, write_smooth, write_zoom, write_patches, write_far, write_huge, write_vast,
    write_grazed, write_mirrors;

/* scenes_lights.c */
maker write_rims, write_slivers, write_lamps, write_thousands, write_crowds, write_inplane,
    write_near, write_sunset, write_flatly, write_shaped, write_shown;

/* scenes_dressed.c */
maker write_dressed;

/* scenes_shadows.c */
maker write_standing, write_folds, write_touched, write_level, write_straight, write_hidden;

#endif
