#include "import/maps.h"

#include <ctype.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "import/cutout.h"
#include "import/mean.h"
#include "import/metal.h"
#include "import/relief.h"

/* glTF's normalTexture.scale, which assimp's header of materials does not have. */
#define NORMAL_SCALE "$tex.scale"

enum { FILE_MOST = 1 << 28, PATH_ROOM = 4096, CUTS_MOST = 8 /* of one picture */ };

/* ---- Files ---- */

/* The bytes of a regular file, which nobody frees. NULL: it cannot be read. */
static void *read_file(const char *path, size_t *size) {
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    struct stat info;
    char *bytes = NULL;
    if (file < 0) return NULL;
    if (!fstat(file, &info) && S_ISREG(info.st_mode) && info.st_size > 0 &&
        info.st_size <= FILE_MOST)
        bytes = malloc((size_t)info.st_size);
    *size = 0;
    while (bytes && *size < (size_t)info.st_size) {
        const ssize_t got = read(file, bytes + *size, (size_t)info.st_size - *size);
        if (got <= 0) break;
        *size += (size_t)got;
    }
    close(file);
    return bytes;
}

static void decode_percents(const char *from, char *to) {
    for (; *from; from++) {
        unsigned code;
        const bool coded = *from == '%' && isxdigit((unsigned char)from[1]) &&
                           isxdigit((unsigned char)from[2]) && sscanf(from + 1, "%2x", &code) == 1;
        *to++ = coded ? (char)code : *from;
        if (coded) from += 2;
    }
    *to = 0;
}

/* Reads `name` in the model's folder. */
static void *read_beside(const shd_map_reader *r, const char *name, size_t *size) {
    char path[PATH_ROOM];
    const char *slash = strrchr(r->model, '/');
    const int length = slash ? (int)(slash + 1 - r->model) : 0;
    const int wrote = snprintf(path, sizeof path, "%.*s%s", length, r->model, name);
    return wrote > 0 && wrote < PATH_ROOM ? read_file(path, size) : NULL;
}

/* As it is written, with what its bytes stand for in a URI, and the last part of it: MTL files hold
 * paths of the disk that they were written on. No path from the root is followed. */
static void *read_named(const shd_map_reader *r, const char *name, size_t *size) {
    char plain[PATH_ROOM];
    if (strlen(name) >= sizeof plain) return NULL;
    strcpy(plain, name);
    for (char *c = plain; *c; c++)
        if (*c == '\\') *c = '/';
    const bool rooted = *plain == '/' || (isalpha((unsigned char)plain[0]) && plain[1] == ':');
    void *bytes = rooted ? NULL : read_beside(r, plain, size);
    if (!bytes && !rooted) {
        char decoded[PATH_ROOM];
        decode_percents(plain, decoded);
        if (*decoded != '/') bytes = read_beside(r, decoded, size);
    }
    const char *last = strrchr(plain, '/');
    if (!bytes && last && last[1]) bytes = read_beside(r, last + 1, size);
    return bytes;
}

/* ---- Pictures ---- */

/* The picture of the model's own file that is called "*3": it is a file if it has no height. NULL:
 * there is none. */
static const struct aiTexture *find_embedded(const shd_map_reader *r, const char *name) {
    char *end;
    const unsigned long index = strtoul(name + 1, &end, 10);
    if (end == name + 1 || *end || index >= r->scene->mNumTextures) return NULL;
    const struct aiTexture *texture = r->scene->mTextures[index];
    return texture->mHeight || !texture->pcData ? NULL : texture;
}

/* What people call a picture. */
static const char *find_name(const shd_map_reader *r, const char *name) {
    const struct aiTexture *texture = *name == '*' ? find_embedded(r, name) : NULL;
    return texture && texture->mFilename.length ? texture->mFilename.data : name;
}

static shd_model_picture make_picture(shd_map_reader *r, const char *name, const void *bytes,
                                      size_t size) {
    shd_model_picture out = {.name = shd_block_text(r->block, name)};
    out.bytes = shd_block_items(r->block, bytes, bytes ? size : 0, 1);
    out.measured = bytes && shd_measure_picture(bytes, size, out.mean, out.linear);
    return out;
}

static shd_model_picture load_picture(shd_map_reader *r, const char *name) {
    const struct aiTexture *texture = *name == '*' ? find_embedded(r, name) : NULL;
    size_t size = texture ? texture->mWidth : 0;
    const void *bytes = texture        ? (const void *)texture->pcData
                        : *name == '*' ? NULL
                                       : read_named(r, name, &size);
    return make_picture(r, find_name(r, name), bytes, size);
}

/* 1 + the index of the picture that has this key; 0: none has. */
static uint32_t find_picture(const shd_map_reader *r, const char *key) {
    for (size_t i = 0; i < r->count; i++)
        if (!strcmp(r->keys[i].text, key)) return (uint32_t)(i + 1);
    return 0;
}

/* Room for one more, whose key is put. */
static bool put_key(shd_map_reader *r, const char *key) {
    if (r->full || r->block->full) return false;
    if (r->count == r->capacity) {
        const size_t capacity = r->capacity ? 2 * r->capacity : 16;
        shd_model_picture *more = realloc(r->pictures, capacity * sizeof *more);
        shd_picture_key *keys = realloc(r->keys, capacity * sizeof *keys);
        if (more) r->pictures = more;
        if (keys) r->keys = keys;
        r->full = !more || !keys;
        if (r->full) return false;
        r->capacity = capacity;
    }
    r->keys[r->count] = (shd_picture_key){.text = strdup(key)};
    r->full = !r->keys[r->count].text;
    return !r->full;
}

/* 1 + the index of a picture. */
static uint32_t put_picture(shd_map_reader *r, const char *name) {
    const uint32_t known = find_picture(r, name);
    if (known || !put_key(r, name)) return known;
    r->pictures[r->count++] = load_picture(r, name);
    return (uint32_t)r->count;
}

/* ---- Maps ---- */

static int wrap_of(const struct aiMaterial *m, const char *key, unsigned type) {
    int mode = aiTextureMapMode_Wrap;
    aiGetMaterialIntegerArray(m, key, type, 0, &mode, NULL);
    return mode == aiTextureMapMode_Clamp || mode == aiTextureMapMode_Decal ? SHD_MODEL_CLAMP
           : mode == aiTextureMapMode_Mirror                                ? SHD_MODEL_MIRROR
                                                                            : SHD_MODEL_REPEAT;
}

/* glTF scales, turns and moves about the upper left corner. assimp tells that by a turn about the
 * middle, with v upward, and a translation that makes up for both; this undoes it. */
static void place_map(const struct aiMaterial *m, unsigned type, shd_model_map *out) {
    struct aiUVTransform t;
    out->scale[0] = out->scale[1] = 1;
    if (aiGetMaterialUVTransform(m, AI_MATKEY_UVTRANSFORM(type, 0), &t) != aiReturn_SUCCESS) return;
    const double sx = t.mScaling.x, sy = t.mScaling.y, turn = -t.mRotation, c = cos(turn),
                 s = sin(turn);
    const double right = t.mTranslation.x - 0.5 * sx * (1 - c + s),
                 down = 0.5 * sy * (s + c - 1) + 1 - sy - t.mTranslation.y;
    out->scale[0] = (float)sx;
    out->scale[1] = (float)sy;
    out->rotate = (float)(turn * 180 / M_PI);
    out->offset[0] = (float)(right + s * sy);
    out->offset[1] = (float)(1 - down - c * sy);
}

/* Within what scenes may have. */
static void hold_bump(const shd_map_reader *r, const char *name, shd_model_map *map) {
    const float most = 1000, given = map->bump;
    map->bump = isnan(given) ? 1 : fminf(fmaxf(given, -most), most);
    if (map->bump != given)
        shd_lose(r->losses,
                 "material \"%s\": its picture of normals has a scale of %g, which is taken for %g",
                 name, (double)given, (double)map->bump);
}

static float bump_of(const struct aiMaterial *m, unsigned type) {
    ai_real scale = 1;
    aiGetMaterialFloatArray(m, NORMAL_SCALE, type, 0, &scale, NULL);
    return (float)scale;
}

static shd_model_map_kind kind_of(int type, uint32_t material) {
    switch (type) {
    case aiTextureType_AMBIENT:
        return SHD_MAP_AMBIENT;
    case aiTextureType_DIFFUSE:
    case aiTextureType_BASE_COLOR:
        return SHD_MAP_DIFFUSE;
    case aiTextureType_SPECULAR:
        return SHD_MAP_SPECULAR;
    case aiTextureType_EMISSIVE:
    case aiTextureType_EMISSION_COLOR:
        return SHD_MAP_EMISSIVE;
    case aiTextureType_OPACITY:
        return SHD_MAP_OPACITY;
    case aiTextureType_NORMALS:
        return SHD_MAP_NORMAL;
    case aiTextureType_SHININESS:
        return material == SHD_MODEL_MTL ? SHD_MAP_GLOSS : SHD_MAP_KINDS;
    case aiTextureType_METALNESS:
    case aiTextureType_DIFFUSE_ROUGHNESS:
    case aiTextureType_UNKNOWN:
        return material == SHD_MODEL_METAL_ROUGH ? SHD_MAP_METAL_ROUGH : SHD_MAP_KINDS;
    case aiTextureType_LIGHTMAP:
    case aiTextureType_AMBIENT_OCCLUSION:
        return material == SHD_MODEL_METAL_ROUGH || material == SHD_MODEL_GLOSSY ? SHD_MAP_OCCLUSION
                                                                                 : SHD_MAP_KINDS;
    default:
        return SHD_MAP_KINDS;
    }
}

static const char *use_of(int type) {
    switch (type) {
    case aiTextureType_SHININESS:
        return "exponents or glossiness";
    case aiTextureType_DISPLACEMENT:
        return "displacement";
    case aiTextureType_REFLECTION:
        return "reflections";
    case aiTextureType_LIGHTMAP:
    case aiTextureType_AMBIENT_OCCLUSION:
        return "occlusion";
    default: /* of clear coats, sheen, transmission and what is newer */
        return "another use";
    }
}

/* MTL: what its statement says of a picture's file and place. */
static const shd_mtl_map *find_statement(const shd_map_reader *r, shd_model_map_kind kind,
                                         const char *material) {
    static const char *const statements[SHD_MAP_TAKEN] = {
        [SHD_MAP_AMBIENT] = "map_Ka",  [SHD_MAP_DIFFUSE] = "map_Kd", [SHD_MAP_SPECULAR] = "map_Ks",
        [SHD_MAP_EMISSIVE] = "map_Ke", [SHD_MAP_OPACITY] = "map_d",  [SHD_MAP_NORMAL] = "norm",
        [SHD_MAP_GLOSS] = "map_Ns"};
    return kind < SHD_MAP_TAKEN ? shd_mtl_find(r->mtl, material, statements[kind]) : NULL;
}

static void apply_statement(const shd_mtl_map *said, shd_model_map *map) {
    for (int k = 0; k < 2; k++) {
        map->scale[k] = said->scale[k];
        map->offset[k] = said->offset[k];
    }
    map->wrap = said->clamp ? SHD_MODEL_CLAMP : SHD_MODEL_REPEAT;
    map->uneven = false;
    map->bump = said->bump;
}

/* assimp takes `-s 2 2 wood.png` for four words of an option, and sees no file. */
static void put_unseen(shd_map_reader *r, const char *name, shd_model_material *out) {
    for (int kind = 0; kind < SHD_MAP_TAKEN; kind++) {
        const shd_mtl_map *said = find_statement(r, (shd_model_map_kind)kind, name);
        if (!said || !*said->file || out->maps[kind].picture) continue;
        out->maps[kind] = (shd_model_map){.picture = put_picture(r, said->file)};
        apply_statement(said, &out->maps[kind]);
    }
}

/* How many pictures have keys that begin so. */
static size_t count_pictures(const shd_map_reader *r, const char *begin, size_t length) {
    size_t count = 0;
    for (size_t i = 0; i < r->count; i++) count += !strncmp(r->keys[i].text, begin, length);
    return count;
}

void shd_put_cut_out(shd_map_reader *r, float factor, shd_model_material *out) {
    const shd_model_map *base = &out->maps[SHD_MAP_DIFFUSE];
    if (!base->picture || !out->cutoff) return;
    const shd_model_picture *whole = &r->pictures[base->picture - 1];
    if (!whole->measured || whole->mean[3] >= 1) return;
    char key[96];
    const int begin = snprintf(key, sizeof key, "cut out of %u at ", base->picture);
    snprintf(key + begin, sizeof key - (size_t)begin, "%a of %a", (double)out->cutoff,
             (double)factor);
    uint32_t mask = find_picture(r, key);
    void *file;
    size_t length;
    /* Each takes as long as its picture to decode. */
    if (!mask && count_pictures(r, key, (size_t)begin) < CUTS_MOST &&
        shd_cut_out(r->block->bytes + whole->bytes.at, whole->bytes.count, factor, out->cutoff,
                    &file, &length)) {
        if (put_key(r, key)) {
            r->pictures[r->count++] = make_picture(r, key, file, length);
            mask = (uint32_t)r->count;
        }
        free(file);
    }
    if (!mask) return;
    out->maps[SHD_MAP_OPACITY] = *base;
    out->maps[SHD_MAP_OPACITY].picture = mask;
}

/* ---- Metal ---- */

static bool same_place(const shd_model_map *a, const shd_model_map *b) {
    bool same = a->wrap == b->wrap && a->uneven == b->uneven && a->channel == b->channel &&
                a->rotate == b->rotate;
    for (int k = 0; k < 2; k++)
        same = same && a->scale[k] == b->scale[k] && a->offset[k] == b->offset[k];
    return same;
}

static shd_metal_source source_of(const shd_map_reader *r, const shd_model_map *map) {
    shd_metal_source out = {.bytes = NULL};
    if (!map->picture) return out;
    const shd_model_picture *p = &r->pictures[map->picture - 1];
    out.bytes = r->block->bytes + p->bytes.at;
    out.size = p->bytes.count;
    return out;
}

/* Makes both pictures, the first of which has this key: 1 + its index. It has no bytes if there are
 * none. 0: there is no memory. */
static uint32_t split_metal(shd_map_reader *r, const char *key, const shd_model_material *m) {
    shd_metal_source base = source_of(r, &m->maps[SHD_MAP_DIFFUSE]),
                     metal = source_of(r, &m->maps[SHD_MAP_METAL_ROUGH]);
    shd_model_material even = *m;
    shd_metal made = {.beneath = NULL};
    memcpy(base.factor, m->diffuse, sizeof base.factor);
    metal.factor[0] = m->metallic;
    if (metal.bytes)
        even.roughness *= r->pictures[m->maps[SHD_MAP_METAL_ROUGH].picture - 1].mean[1];
    const bool split = shd_split_metal(&base, &metal, &even, &made);
    if (put_key(r, key))
        r->pictures[r->count++] = make_picture(r, "beneath metal", made.beneath, made.beneath_size);
    const uint32_t first = (uint32_t)r->count;
    if (split && put_key(r, "metal"))
        r->pictures[r->count++] = make_picture(r, "metal", made.mirrored, made.mirrored_size);
    free(made.beneath);
    free(made.mirrored);
    return r->full ? 0 : first;
}

/* Whether the texels of a map are known, if there is one. */
static bool is_measured(const shd_map_reader *r, const shd_model_map *map) {
    return !map->picture || r->pictures[map->picture - 1].measured;
}

void shd_put_metal(shd_map_reader *r, shd_model_material *out) {
    const shd_model_map *metal = &out->maps[SHD_MAP_METAL_ROUGH],
                        *base = &out->maps[SHD_MAP_DIFFUSE];
    if (out->kind != SHD_MODEL_METAL_ROUGH || out->unlit || out->transmission > 0) return;
    if (!(out->metallic > 0) || !is_measured(r, base) || !is_measured(r, metal)) return;
    if (metal->picture && base->picture && !same_place(base, metal)) return;
    const shd_model_map *place = metal->picture ? metal : base;
    if (!place->picture) return;
    char key[192];
    const int begin = snprintf(key, sizeof key, "beneath %u of ", place->picture);
    snprintf(key + begin, sizeof key - (size_t)begin, "%u by %u, %a %a %a, %a %a %a", base->picture,
             metal->picture, (double)out->diffuse[0], (double)out->diffuse[1],
             (double)out->diffuse[2], (double)out->metallic, (double)out->roughness,
             (double)out->ior);
    uint32_t first = find_picture(r, key);
    /* Each takes as long as both pictures to decode. */
    if (!first && count_pictures(r, key, (size_t)begin) < CUTS_MOST)
        first = split_metal(r, key, out);
    if (!first || !r->pictures[first - 1].bytes.count) return;
    out->maps[SHD_MAP_BENEATH] = out->maps[SHD_MAP_MIRRORED] = *place;
    out->maps[SHD_MAP_BENEATH].picture = first;
    out->maps[SHD_MAP_MIRRORED].picture = first + 1;
}

/* ---- Heights ---- */

/* MTL's statement, and the name of the picture. NULL: there is none. */
static const char *find_heights(const shd_map_reader *r, const struct aiMaterial *m,
                                const char *material, struct aiString *path,
                                const shd_mtl_map **said) {
    *said = shd_mtl_find(r->mtl, material, "map_bump");
    if (!*said) *said = shd_mtl_find(r->mtl, material, "bump");
    if (*said && *(*said)->file) return (*said)->file;
    return aiGetMaterialTexture(m, aiTextureType_HEIGHT, 0, path, NULL, NULL, NULL, NULL, NULL,
                                NULL) == aiReturn_SUCCESS
               ? path->data
               : NULL;
}

/* Blender's files have maps of normals there. Their mean is close to the surface's own. */
static bool looks_like_normals(const shd_model_picture *p) {
    return p->measured && fabsf(p->mean[0] - 0.5f) < 0.1f && fabsf(p->mean[1] - 0.5f) < 0.1f &&
           p->mean[2] > 0.75f;
}

/* 1 + the index of the normals that a picture's heights become, which are made once: many
 * materials may have the same. It has no bytes if its key says that heights are flat or cannot be
 * read. 0: there is no memory. */
static uint32_t put_normals(shd_map_reader *r, uint32_t heights, bool repeats) {
    const shd_model_picture from = r->pictures[heights - 1];
    shd_relief relief = {.file = NULL};
    char key[64], name[PATH_ROOM];
    snprintf(key, sizeof key, "normals of %u, %d", heights, repeats);
    const uint32_t known = find_picture(r, key);
    if (known || !put_key(r, key)) return known;
    const bool made =
        from.bytes.count &&
        shd_normals_of_heights(r->block->bytes + from.bytes.at, from.bytes.count, repeats, &relief);
    r->keys[r->count].steepest = made ? (float)relief.steepest : -1;
    snprintf(name, sizeof name, "%.*s", (int)from.name.count, r->block->bytes + from.name.at);
    r->pictures[r->count++] = make_picture(r, name, relief.file, relief.length);
    free(relief.file);
    return (uint32_t)r->count;
}

/* Turns the map's heights into normals. False: it cannot be done. */
static bool turn_heights(shd_map_reader *r, shd_model_map *map) {
    const uint32_t normals = put_normals(r, map->picture, map->wrap == SHD_MODEL_REPEAT);
    const float steepest = normals ? r->keys[normals - 1].steepest : -1;
    if (steepest < 0) return false;
    map->bump *= steepest;
    map->picture = steepest > 0 ? normals : 0; /* what is flat needs none */
    return true;
}

static void tell_heights(const shd_map_reader *r, const char *material, const char *file,
                         const char *what) {
    shd_lose(r->losses, "material \"%s\": the picture of its heights %s: %s", material, what, file);
}

static void put_heights(shd_map_reader *r, const struct aiMaterial *m, const char *name,
                        shd_model_material *out) {
    struct aiString path;
    const shd_mtl_map *said;
    const char *file = find_heights(r, m, name, &path, &said);
    char text[128];
    if (!file) return;
    if (out->maps[SHD_MAP_NORMAL].picture) {
        tell_heights(r, name, file, "is left out, because it has one of normals");
        return;
    }
    shd_model_map map = {.picture = put_picture(r, file), .scale = {1, 1}, .bump = 1};
    if (!map.picture) return;
    if (said) apply_statement(said, &map);
    if (looks_like_normals(&r->pictures[map.picture - 1])) {
        tell_heights(r, name, file, "has the colors of normals, and is taken for one of these");
    } else {
        snprintf(text, sizeof text, "becomes one of normals, with white %g texels above black",
                 (double)map.bump);
        if (!turn_heights(r, &map)) {
            tell_heights(r, name, file, "is left out, because it cannot be read");
            return;
        }
        tell_heights(r, name, file, map.picture ? text : "is left out, because it is flat");
    }
    if (map.picture) out->maps[SHD_MAP_NORMAL] = map;
}

void shd_put_maps(shd_map_reader *r, const struct aiMaterial *m, const char *name,
                  shd_model_material *out) {
    for (int type = aiTextureType_DIFFUSE; type <= AI_TEXTURE_TYPE_MAX; type++) {
        struct aiString path;
        unsigned channel = 0;
        if (aiGetMaterialTexture(m, (enum aiTextureType)type, 0, &path, NULL, &channel, NULL, NULL,
                                 NULL, NULL) != aiReturn_SUCCESS)
            continue;
        const shd_model_map_kind kind = kind_of(type, out->kind);
        if (type == aiTextureType_HEIGHT) continue; /* once it is known whether there are normals */
        if (kind == SHD_MAP_KINDS) {
            shd_lose(r->losses,
                     "material \"%s\": the picture of its %s is left out, because scenes have no "
                     "such thing: %s",
                     name, use_of(type), find_name(r, path.data));
            continue;
        }
        shd_model_map *map = &out->maps[kind];
        if (map->picture) continue;
        const shd_mtl_map *said = find_statement(r, kind, name);
        const int across = wrap_of(m, _AI_MATKEY_MAPPINGMODE_U_BASE, (unsigned)type),
                  up = wrap_of(m, _AI_MATKEY_MAPPINGMODE_V_BASE, (unsigned)type);
        *map =
            (shd_model_map){.picture = put_picture(r, said && *said->file ? said->file : path.data),
                            .wrap = (uint32_t)across,
                            .uneven = across != up,
                            .channel = channel,
                            .bump = bump_of(m, (unsigned)type)};
        place_map(m, (unsigned)type, map);
        if (said) apply_statement(said, map);
    }
    put_unseen(r, name, out);
    put_heights(r, m, name, out);
    if (out->maps[SHD_MAP_NORMAL].picture) hold_bump(r, name, &out->maps[SHD_MAP_NORMAL]);
}
