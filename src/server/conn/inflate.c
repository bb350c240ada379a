#include "inflate.h"

#include <assert.h>
#include <dlfcn.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <zlib.h>
#include <zstd.h>

/* Bytes between two looks whether it is cancelled: milliseconds, also of blocks of tables only. */
enum { READ_MOST = 16 << 10, WRITE_MOST = 256 << 10 };

enum { FIRST = 4 << 10 }; /* bytes that a body is written to at first; they double */

/* What zlib takes to inflate: 40 KB, a window of 32 among them. */
enum { GZIP_MEMORY = 48 << 10, GZIP_WINDOW_BITS = 15, GZIP_ONLY = 16 };
enum { DEFLATE_ONLY = -GZIP_WINDOW_BITS };

/* What libzstd takes beside the window: 96 KB, a block that comes and one that goes. The window is
 * as much as RFC 9659 lets an encoder ask for (section 3). */
enum { ZSTD_MEMORY = 512 << 10, ZSTD_WINDOW_LOG = 23, ZSTD_WINDOW = 1 << ZSTD_WINDOW_LOG };

static const double patience = 5; /* seconds that others are waited for that give way */

/* ---- Libraries ---- */

static struct {
    __typeof__(&inflateInit2_) begin;
    __typeof__(&inflate) inflate;
    __typeof__(&inflateReset) reset;
    __typeof__(&inflateEnd) end;
} gzip;

static struct {
    __typeof__(&ZSTD_createDCtx) begin;
    __typeof__(&ZSTD_DCtx_setParameter) set;
    __typeof__(&ZSTD_getFrameContentSize) content_size;
    __typeof__(&ZSTD_decompressStream) decompress;
    __typeof__(&ZSTD_isError) is_error;
    __typeof__(&ZSTD_getErrorName) error_name;
    __typeof__(&ZSTD_freeDCtx) end;
} zstd;

static const struct {
    shd_coding coding;
    const char *name;
    void *place; /* of a pointer to a function */
} symbols[] = {{SHD_CODING_GZIP, "inflateInit2_", &gzip.begin},
               {SHD_CODING_GZIP, "inflate", &gzip.inflate},
               {SHD_CODING_GZIP, "inflateReset", &gzip.reset},
               {SHD_CODING_GZIP, "inflateEnd", &gzip.end},
               {SHD_CODING_ZSTD, "ZSTD_createDCtx", &zstd.begin},
               {SHD_CODING_ZSTD, "ZSTD_DCtx_setParameter", &zstd.set},
               {SHD_CODING_ZSTD, "ZSTD_getFrameContentSize", &zstd.content_size},
               {SHD_CODING_ZSTD, "ZSTD_decompressStream", &zstd.decompress},
               {SHD_CODING_ZSTD, "ZSTD_isError", &zstd.is_error},
               {SHD_CODING_ZSTD, "ZSTD_getErrorName", &zstd.error_name},
               {SHD_CODING_ZSTD, "ZSTD_freeDCtx", &zstd.end}};

static const struct {
    const char *name, *library, *what; /* that is in it */
} codings[] = {[SHD_CODING_GZIP] = {"gzip", "libz.so.1", "body"},
               [SHD_CODING_ZSTD] = {"zstd", "libzstd.so.1", "body"},
               [SHD_CODING_DEFLATE] = {"deflate", NULL, "link"}};

static pthread_mutex_t open_mutex = PTHREAD_MUTEX_INITIALIZER;
static bool is_open[sizeof codings / sizeof codings[0]]; /* with the mutex */

/* With the mutex held. Never closed once it is complete. */
static bool open_library(shd_coding coding) {
    void *library = dlopen(codings[coding].library, RTLD_NOW | RTLD_LOCAL);
    if (!library) return false;
    for (size_t i = 0; i < sizeof symbols / sizeof symbols[0]; i++) {
        if (symbols[i].coding != coding) continue;
        void *found = dlsym(library, symbols[i].name);
        if (!found) {
            dlclose(library);
            return false;
        }
        memcpy(symbols[i].place, &found, sizeof found); /* POSIX has both pointers alike */
    }
    return true;
}

bool shd_inflate_open(shd_coding coding) {
    if (coding == SHD_CODING_DEFLATE) coding = SHD_CODING_GZIP; /* one library has both */
    pthread_mutex_lock(&open_mutex);
    /* dlopen tells its reasons in words only: what was want of memory may be over. */
    for (int attempt = 0; attempt < 2 && !is_open[coding]; attempt++)
        is_open[coding] = open_library(coding);
    const bool open = is_open[coding];
    pthread_mutex_unlock(&open_mutex);
    return open;
}

/* ---- The field ---- */

bool shd_coding_read(const char *field, shd_coding *out) {
    static const struct {
        const char *name;
        shd_coding coding;
    } names[] = {{"identity", SHD_CODING_NONE},
                 {"gzip", SHD_CODING_GZIP},
                 {"x-gzip", SHD_CODING_GZIP},
                 {"zstd", SHD_CODING_ZSTD}};
    enum { NAMES = sizeof names / sizeof names[0] };
    static const char blanks[] = " \t,";
    shd_coding coding = SHD_CODING_NONE;
    size_t length;
    for (const char *c = field ? field : ""; *(c += strspn(c, blanks)); c += length) {
        length = strcspn(c, blanks);
        size_t i = 0;
        while (i < NAMES &&
               (strlen(names[i].name) != length || strncasecmp(c, names[i].name, length) != 0))
            i++;
        if (i == NAMES || (coding && names[i].coding)) return false;
        if (names[i].coding) coding = names[i].coding;
    }
    *out = coding;
    return true;
}

const char *shd_coding_list(void) {
    static const char *const lists[2][2] = {{"identity", "zstd"}, {"gzip", "gzip, zstd"}};
    return lists[shd_inflate_open(SHD_CODING_GZIP)][shd_inflate_open(SHD_CODING_ZSTD)];
}

/* ---- One body ---- */

typedef struct flow {
    const shd_inflation *how;
    const char *name, *what; /* of the coding */
    const unsigned char *start, *in;
    size_t left; /* of `in` */
    unsigned char *out;
    size_t size, capacity; /* what came of it so far, and what the budget has taken for that */
    size_t decoder;        /* bytes that the budget has taken for that */
    bool is_enough;        /* more came of it than is kept */
    shd_error *error;
} flow;

static shd_status fail_wrong(const flow *f, const char *why) {
    return shd_fail(f->error, SHD_SYNTAX, "", "the %s is not sound %s, near byte %zu: %s", f->what,
                    f->name, (size_t)(f->in - f->start), why);
}

static shd_status fail_early(const flow *f) {
    return shd_fail(f->error, SHD_SYNTAX, "", "the %s's %zu bytes end before their %s does",
                    f->what, (size_t)(f->in - f->start), f->name);
}

static shd_status fail_long(const flow *f) {
    shd_fail(f->error, SHD_LIMIT, "",
             "the %s goes on after %llu bytes, decoded from %s: that is the limit `body`", f->what,
             (unsigned long long)f->how->most, f->name);
    return shd_fail_limit(f->error, SHD_LIMIT_BODY);
}

static uint64_t find_room(const flow *f) {
    const uint64_t taken = f->capacity + f->decoder;
    return f->how->room > taken ? f->how->room - taken : 0;
}

static shd_status take_memory(flow *f, size_t bytes) {
    if (bytes > find_room(f)) {
        shd_fail(f->error, SHD_LIMIT, "",
                 "the %s, decoded from %s, takes more than the %llu bytes that the limit "
                 "`memory` leaves for it",
                 f->what, f->name, (unsigned long long)f->how->room);
        return shd_fail_limit(f->error, SHD_LIMIT_MEMORY);
    }
    if (shd_budget_wait(f->how->budget, bytes, patience)) return SHD_OK;
    shd_fail(f->error, SHD_CROWDED, "",
             "other requests have the memory just now: the limit `memory` leaves too little");
    shd_fail_limit(f->error, SHD_LIMIT_MEMORY);
    return SHD_CROWDED;
}

/* The decoder takes this much from now on, if it took less before. */
static shd_status reserve_decoder(flow *f, size_t bytes) {
    if (bytes <= f->decoder) return SHD_OK;
    const shd_status status = take_memory(f, bytes - f->decoder);
    if (!status) f->decoder = bytes;
    return status;
}

/* One byte more than are kept tells that there are more. */
static shd_status grow_output(flow *f) {
    const uint64_t keep = f->how->keep < f->how->most ? f->how->keep : f->how->most;
    size_t more = f->capacity ? f->capacity : FIRST;
    if (more > keep + 1 - f->capacity) more = (size_t)(keep + 1 - f->capacity);
    const uint64_t room = find_room(f);
    if (more > room && room) more = (size_t)room;
    const shd_status status = take_memory(f, more);
    if (status) return status;
    const size_t capacity = f->capacity + more;
    unsigned char *grown = realloc(f->out, capacity);
    if (!grown) {
        shd_budget_give(f->how->budget, more);
        return shd_fail(f->error, SHD_EXHAUSTED, "", "no memory for the decoded body");
    }
    f->out = grown;
    f->capacity = capacity;
    return SHD_OK;
}

/* Before each piece: whether it is wanted still, and room for it. */
static shd_status prepare_piece(flow *f) {
    if (f->how->request && shd_request_is_cancelled(f->how->request))
        return shd_fail(f->error, SHD_CANCELLED, "", "cancelled");
    if (f->size > f->how->most) return fail_long(f);
    f->is_enough = f->size > f->how->keep;
    return f->size == f->capacity && !f->is_enough ? grow_output(f) : SHD_OK;
}

static size_t least_size(size_t a, size_t b) {
    return a < b ? a : b;
}

static void advance_flow(flow *f, size_t read, size_t written) {
    assert(read <= f->left && written <= f->capacity - f->size);
    f->in += read;
    f->left -= read;
    f->size += written;
}

static shd_status inflate_members(flow *f, z_stream *z, bool is_alone) {
    int code = Z_OK;
    do {
        const shd_status status = prepare_piece(f);
        if (status || f->is_enough) return status;
        if (code == Z_STREAM_END && is_alone) return fail_wrong(f, "bytes follow its end");
        if (code == Z_STREAM_END) gzip.reset(z);
        const size_t in = least_size(f->left, READ_MOST);
        const size_t room = least_size(f->capacity - f->size, WRITE_MOST);
        z->next_in = (unsigned char *)(size_t)f->in;
        z->avail_in = (unsigned)in;
        z->next_out = f->out + f->size;
        z->avail_out = (unsigned)room;
        code = gzip.inflate(z, Z_NO_FLUSH);
        advance_flow(f, in - z->avail_in, room - z->avail_out);
        if (code == Z_BUF_ERROR) return fail_early(f);
        if (code == Z_MEM_ERROR) return shd_fail(f->error, SHD_EXHAUSTED, "", "no memory for zlib");
        if (code != Z_OK && code != Z_STREAM_END)
            return fail_wrong(f, z->msg ? z->msg : "it wants a dictionary");
    } while (f->left || code != Z_STREAM_END);
    return SHD_OK;
}

static shd_status inflate_zlib(flow *f, int window_bits, bool is_alone) {
    z_stream z = {0};
    shd_status status = reserve_decoder(f, GZIP_MEMORY);
    if (status) return status;
    if (gzip.begin(&z, window_bits, ZLIB_VERSION, (int)sizeof z) != Z_OK)
        return shd_fail(f->error, SHD_EXHAUSTED, "", "no memory for zlib");
    status = inflate_members(f, &z, is_alone);
    gzip.end(&z);
    return status;
}

/* What the head of a frame tells: that it is one, that it is not too long, and the window that it
 * takes, which is never more than its content. */
static shd_status begin_frame(flow *f) {
    const unsigned char *in = f->in;
    if (f->left >= 4) {
        const uint32_t magic =
            in[0] | (uint32_t)in[1] << 8 | (uint32_t)in[2] << 16 | (uint32_t)in[3] << 24;
        const bool is_skipped = (magic & ZSTD_MAGIC_SKIPPABLE_MASK) == ZSTD_MAGIC_SKIPPABLE_START;
        if (magic != ZSTD_MAGICNUMBER && !is_skipped) return fail_wrong(f, "no frame begins here");
    }
    const unsigned long long content = zstd.content_size(in, f->left);
    const bool is_known = content != ZSTD_CONTENTSIZE_UNKNOWN && content != ZSTD_CONTENTSIZE_ERROR;
    if (is_known && content > f->how->most - f->size) return fail_long(f);
    return reserve_decoder(f, ZSTD_MEMORY +
                                  least_size(is_known ? (size_t)content : SIZE_MAX, ZSTD_WINDOW));
}

static shd_status inflate_frames(flow *f, ZSTD_DCtx *context) {
    size_t code = 0; /* 0: a frame has ended */
    do {
        shd_status status = prepare_piece(f);
        if (!status && !f->is_enough && !code) status = begin_frame(f);
        if (status || f->is_enough) return status;
        ZSTD_inBuffer in = {f->in, least_size(f->left, READ_MOST), 0};
        ZSTD_outBuffer out = {f->out + f->size, least_size(f->capacity - f->size, WRITE_MOST), 0};
        code = zstd.decompress(context, &out, &in);
        advance_flow(f, in.pos, out.pos);
        if (zstd.is_error(code)) return fail_wrong(f, zstd.error_name(code));
        /* What is written to the end of its room may have more to write. */
        if (code && !f->left && out.pos < out.size) return fail_early(f);
    } while (f->left || code);
    return SHD_OK;
}

static shd_status inflate_zstd(flow *f) {
    ZSTD_DCtx *context = zstd.begin();
    if (!context) return shd_fail(f->error, SHD_EXHAUSTED, "", "no memory for libzstd");
    zstd.set(context, ZSTD_d_windowLogMax, ZSTD_WINDOW_LOG);
    const shd_status status = inflate_frames(f, context);
    zstd.end(context);
    return status;
}

/* Gives back what the body did not take. */
static void fit_output(flow *f) {
    unsigned char *smaller = f->size ? realloc(f->out, f->size) : NULL;
    if (!smaller) return;
    shd_budget_give(f->how->budget, f->capacity - f->size);
    f->out = smaller;
    f->capacity = f->size;
}

shd_status shd_inflate(shd_coding coding, const void *body, size_t size, const shd_inflation *how,
                       unsigned char **out, size_t *out_size, size_t *taken, shd_error *error) {
    const unsigned char *in = size ? body : (const unsigned char *)""; /* else it may be NULL */
    flow f = {.how = how,
              .name = codings[coding].name,
              .what = codings[coding].what,
              .start = in,
              .in = in,
              .left = size,
              .error = error};
    shd_status status = coding == SHD_CODING_GZIP
                            ? inflate_zlib(&f, GZIP_WINDOW_BITS + GZIP_ONLY, false)
                        : coding == SHD_CODING_DEFLATE ? inflate_zlib(&f, DEFLATE_ONLY, true)
                                                       : inflate_zstd(&f);
    shd_budget_give(how->budget, f.decoder);
    if (!status && f.size > how->most) status = fail_long(&f);
    const bool is_whole = f.size <= how->keep;
    if (!status && is_whole) {
        fit_output(&f);
    } else {
        free(f.out);
        shd_budget_give(how->budget, f.capacity);
        f.out = NULL;
        f.capacity = 0;
    }
    if (status) return status;
    *out = f.out;
    *out_size = f.size;
    if (!is_whole) { /* what it would come to, if it went on as it has begun */
        const double guess = (double)f.size * (double)size / (double)(size - f.left);
        *out_size = guess < (double)how->most ? (size_t)guess : (size_t)how->most;
    }
    *taken = f.capacity;
    return SHD_OK;
}
