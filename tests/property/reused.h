/* What engines keep between requests, beside engines that forget. */
#ifndef SHD_TEST_REUSED_H
#define SHD_TEST_REUSED_H

#include "property/film_of.h"

/* The first file of a scene, for free(), and what it was made of. */
static inline file file_of(shd_engine *engine, const char *json, shd_reused *reused) {
    shd_request *request = read_scene(engine, json);
    shd_error error;
    assert_int_equal(shd_request_render(request, NULL, &error), SHD_OK);
    size_t count;
    file out = {NULL, shd_request_pictures(request, &count)[0].size};
    out.data = shd_request_take(request, 0);
    *reused = shd_request_reused(request);
    shd_request_drop(request);
    return out;
}

/* What a scene's file was made of, whose bytes are those of an engine that forgets. Frees the
 * scene. */
static inline shd_reused reused_for(shd_engine *keeps, shd_engine *forgets, char *json) {
    shd_reused reused, none;
    file a = file_of(keeps, json, &reused), b = file_of(forgets, json, &none);
    if (!same_file(a, b)) fail_msg("what is kept changes bytes of %s", json);
    assert_int_equal(none, SHD_REUSED_NOTHING);
    free(a.data);
    free(b.data);
    free(json);
    return reused;
}

#endif
