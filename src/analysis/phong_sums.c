/* Sums over rows, from which everything is solved. */
#include <string.h>

#include "analysis/phong_parts.h"

shd_status shd_fit_cancelled(shd_error *error) {
    return shd_fail(error, SHD_CANCELLED, "", "the fit was cancelled");
}

shd_status shd_fit_sum_base(shd_fitting *f, shd_error *error) {
    const shd_fit_rows *rows = f->rows;
    memset(f->base, 0, sizeof f->base);
    for (size_t i = 0; i < 3 * rows->count; i++) {
        if (shd_is_cancelled_at(f->cancelled, i)) return shd_fit_cancelled(error);
        const double w = (double)rows->weight[i], ww = w * w, y = (double)rows->light[i],
                     d = (double)rows->diffuse[i];
        shd_products *p = &f->base[i % 3];
        p->columns[0][0] += ww;
        p->columns[0][1] += ww * d;
        p->columns[1][1] += ww * d * d;
        p->values[0] += ww * y;
        p->values[1] += ww * d * y;
        p->square += ww * y * y;
    }
    for (int c = 0; c < 3; c++) f->base[c].columns[1][0] = f->base[c].columns[0][1];
    return SHD_OK;
}

shd_status shd_fit_add_lobe(const shd_fitting *f, const float *lobe, shd_products out[3],
                            shd_error *error) {
    const shd_fit_rows *rows = f->rows;
    memcpy(out, f->base, sizeof f->base);
    for (size_t i = 0; i < 3 * rows->count; i++) {
        if (shd_is_cancelled_at(f->cancelled, i)) return shd_fit_cancelled(error);
        const double w = (double)rows->weight[i], ws = w * w * (double)lobe[i];
        shd_products *p = &out[i % 3];
        p->columns[0][2] += ws;
        p->columns[1][2] += ws * (double)rows->diffuse[i];
        p->columns[2][2] += ws * (double)lobe[i];
        p->values[2] += ws * (double)rows->light[i];
    }
    for (int c = 0; c < 3; c++) {
        out[c].columns[2][0] = out[c].columns[0][2];
        out[c].columns[2][1] = out[c].columns[1][2];
    }
    return SHD_OK;
}

double shd_fit_solve(shd_candidate *k) {
    k->rest = 0;
    for (int c = 0; c < 3; c++) k->rest += shd_least_squares(&k->products[c], k->x[c]);
    return k->rest;
}
