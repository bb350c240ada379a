/* The pictures that a scene names, as reading it finds them. */
#include <string.h>

#include "render/pictures.h"

enum { WISHES_MOST = 256 };

/* What came of a wish, so that nothing is decoded again for one scene, even where nothing is kept.
 */
struct shd_wished {
    struct shd_wished *next;
    shd_picture_wish wish;
    const shd_texels *texels; /* NULL: */
    shd_error error;
};

static shd_status find_wish(shd_request *request, const shd_picture_wish *wish,
                            const struct shd_wished **out, shd_error *error) {
    shd_arena *arena = request->rendering.arena;
    const struct shd_wished *refused = NULL;
    size_t count = 0;
    for (const struct shd_wished *w = request->wished; w; w = w->next, count++) {
        *out = w;
        if (!w->texels && w->error.limit == SHD_LIMIT_MEMORY) refused = w;
        if (w->wish.space == wish->space && w->wish.working == wish->working &&
            w->wish.normals == wish->normals && w->wish.scale == wish->scale &&
            !strcmp(w->wish.name, wish->name))
            return SHD_OK;
    }
    /* Where there is no room for one, none of the others is decoded to be told the same. */
    if (refused) {
        *out = refused;
        return SHD_OK;
    }
    if (count == WISHES_MOST)
        return shd_fail(error, SHD_SCENE, "", "a scene names at most %d pictures", WISHES_MOST);
    struct shd_wished *added = shd_arena_zalloc(arena, 1, sizeof *added);
    char *name = added ? shd_arena_strdup(arena, wish->name) : NULL;
    if (!name) return shd_rendering_full(&request->rendering, "picture", error);
    added->next = request->wished;
    added->wish = *wish;
    added->wish.name = name;
    if (shd_request_texels(request, wish, &added->texels, &added->error) != SHD_OK)
        added->texels = NULL;
    *out = request->wished = added;
    return SHD_OK;
}

shd_status shd_wished_texels(void *context, const shd_picture_wish *wish, const shd_texels **out,
                             shd_error *error) {
    const struct shd_wished *wished = NULL;
    const shd_status status = find_wish(context, wish, &wished, error);
    if (status != SHD_OK) return status;
    *out = wished->texels;
    if (!wished->texels) *error = wished->error;
    return wished->texels ? SHD_OK : wished->error.status;
}

shd_status shd_wished_pyramid(void *context, const shd_texels *texels, const shd_pyramid **out,
                              shd_error *error) {
    return shd_request_pyramid(context, texels, out, error);
}
