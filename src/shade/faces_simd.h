/* Flat faces in a block of pixels, by vectors. Only for sketch.simd.c. */
#pragma once

/* A row of what a job has of a face: at + x right + y down. */
SHD_INLINE shd_vf climb(const float ramp[3], shd_vf x, shd_vf y) {
    return shd_mad(y, shd_vf_set(ramp[2]), shd_mad(x, shd_vf_set(ramp[1]), shd_vf_set(ramp[0])));
}

/* What is seen through the vector of pixels from `i` on: each of the faces that it meets is
 * reckoned for all of its lanes, which mostly meet the same. */
SHD_INLINE seen meet_faces(const shd_sketch_job *j, int i, shd_vf x, shd_vf y) {
    const shd_vf one = shd_vf_set(1), faces = shd_vf_load(j->face_of + i);
    shd_vf rows[SHD_SKETCH_ROWS], w[3];
    seen out;
    const shd_sketch_face *first = &j->faces[(int)j->face_of[i]];
#pragma GCC unroll 7
    for (int r = 0; r < SHD_SKETCH_ROWS; r++) rows[r] = climb(first->row[r], x, y);
    shd_vf mine = shd_vf_set(j->face_of[i]);
    unsigned left = shd_mf_bits(shd_mf_or(shd_vf_gt(faces, mine), shd_vf_gt(mine, faces)));
    while (left) {
        const float of = j->face_of[i + __builtin_ctz(left)];
        const shd_sketch_face *face = &j->faces[(int)of];
        mine = shd_vf_set(of);
        const shd_mf others = shd_mf_or(shd_vf_gt(faces, mine), shd_vf_gt(mine, faces));
#pragma GCC unroll 7
        for (int r = 0; r < SHD_SKETCH_ROWS; r++)
            rows[r] = shd_vf_select(others, rows[r], climb(face->row[r], x, y));
        left &= shd_mf_bits(others);
    }
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++)
        w[c] = climb((const float[]){j->way[c], j->way_x[c], j->way_y[c]}, x, y);
    const shd_vf weight = one / rows[SHD_SKETCH_WEIGHT],
                 length = one / shd_vf_sqrt(dot_lanes(rows, rows)),
                 inverse = one / shd_vf_sqrt(dot_lanes(w, w));
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        out.normal[c] = rows[c] * length;
        out.moved[c] = rows[3 + c] * weight;
        w[c] = w[c] * inverse;
    }
    const shd_vf along = dot_lanes(out.normal, w), twice = along + along;
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) out.mirror[c] = shd_mad(-twice, out.normal[c], w[c]);
    return out;
}
