/* Which triangles of a mesh a block's rays meet. Compiled once an instruction set. */
#include "sight/list_faces.h"

static_assert((int)SHD_RAYS == (int)SHD_BLOCK_RAYS, "a block is cast at once");

/* Places the rays. Their cosines only tell what is at the eye from what is seen. */
static void place_rays(const shd_lens *lens, bool orthographic, double x, double y, shd_batch *b) {
    SHD_EACH_LANE(i) {
        b->x[i] = x + i % SHD_BLOCK_SIDE;
        b->y[i] = y + i / SHD_BLOCK_SIDE;
    }
    if (orthographic) {
        SHD_EACH_LANE(i) b->cosine[i] = 1;
        return;
    }
    const double middle_x = lens->middle_x, middle_y = lens->middle_y, across = lens->step_x,
                 up = lens->step_y;
    SHD_EACH_LANE(i) {
        const double p = (b->x[i] - middle_x) * across, q = (middle_y - b->y[i]) * up;
        b->cosine[i] = 1 / sqrt(1 + p * p + q * q);
    }
}

/* Sets a face's number for the rays that meet it. Returns which these are. */
SHD_INLINE uint64_t number_rays(const double *name, double of, float number, float *out) {
    const shd_vd wanted = shd_vd_set(of);
    uint64_t mine = 0;
    for (int i = 0; i < SHD_RAYS; i += SHD_W / 2) {
        const shd_vd names = shd_vd_load(name + i);
        const shd_md others = shd_md_or(shd_vd_gt(names, wanted), shd_vd_gt(wanted, names));
        mine |= (uint64_t)(~shd_md_bits(others) & ((1u << SHD_W / 2) - 1)) << i;
    }
    for (uint64_t left = number > 0 ? mine : 0; left; left &= left - 1)
        out[__builtin_ctzll(left)] = number;
    return mine;
}

bool SHD_VARIANT(shd_list_faces)(const shd_sight *sight, const shd_item *it, double x, double y,
                                 uint32_t list[SHD_FACES_MOST], shd_block_faces *out) {
    SHD_ALIGNED double name[SHD_RAYS];
    shd_batch b;
    out->count = 0;
    out->hit = 0;
    place_rays(&sight->lens, it->view.orthographic, x, y, &b);
    if (!SHD_VARIANT(shd_name_triangles)(&sight->lens, it, &b, name)) return true;
    memset(out->of, 0, sizeof out->of);
    for (uint64_t left = ~number_rays(name, INFINITY, 0, out->of); left;) {
        if (out->count == SHD_FACES_MOST) return false;
        const double of = name[__builtin_ctzll(left)];
        const uint64_t mine = number_rays(name, of, (float)out->count, out->of);
        list[out->count++] = (uint32_t)of >> 4;
        out->hit |= mine;
        left &= ~mine;
    }
    return true;
}
