#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

#include "image/encoders.h"
#include "image/icc.h"
#include "image/pack.h"

static const char icc_mark[] = "ICC_PROFILE"; /* with its terminating 0, ICC.1:2010 B.4 */

/* libturbojpeg 2.1 cannot write a profile: its APP2 segment goes behind the JFIF segment, which
 * the standard wants first. */
static shd_status assemble(const unsigned char *jpeg, size_t size, const shd_icc *icc,
                           shd_bytes *out, shd_error *error) {
    size_t head = 2;
    if (size > 6 && jpeg[2] == 0xFF && jpeg[3] == 0xE0) head += 2 + (jpeg[4] * 256u + jpeg[5]);
    size_t segment = icc->size ? 2 + 2 + sizeof icc_mark + 2 + icc->size : 0;
    if (head > size) return shd_fail(error, SHD_INTERNAL, "", "libjpeg-turbo wrote no JPEG");
    unsigned char *data = malloc(size + segment);
    if (!data) return shd_encode_no_memory(error);

    unsigned char *at = data;
    memcpy(at, jpeg, head);
    at += head;
    if (segment) {
        size_t length = segment - 2;
        *at++ = 0xFF;
        *at++ = 0xE2;
        *at++ = (unsigned char)(length >> 8);
        *at++ = (unsigned char)length;
        memcpy(at, icc_mark, sizeof icc_mark);
        at += sizeof icc_mark;
        *at++ = 1; /* the first of one */
        *at++ = 1;
        memcpy(at, icc->data, icc->size);
        at += icc->size;
    }
    memcpy(at, jpeg + head, size - head);
    *out = (shd_bytes){data, size + segment};
    return SHD_OK;
}

shd_status shd_encode_jpeg(const shd_image *image, shd_arena *scratch, shd_bytes *out,
                           shd_error *error) {
    shd_pack pack = shd_pack_of(image, SHD_JPEG);
    bool grey = pack.count == 1;
    /* Coarse chroma shows at colored edges; whoever asks for high quality looks for them. */
    int sampling = grey ? TJSAMP_GRAY : image->quality >= 90 ? TJSAMP_444 : TJSAMP_420;
    unsigned long bound = tjBufSize(image->width, image->height, sampling);
    if (bound == (unsigned long)-1) return shd_encode_no_memory(error);
    const unsigned char *pixels = shd_pack_samples(&pack, image, scratch);
    unsigned char *jpeg = shd_arena_alloc(scratch, bound, 1);
    if (!pixels || !jpeg) return shd_encode_no_memory(error);

    tjhandle handle = tjInitCompress();
    if (!handle) return shd_encode_no_memory(error);
    unsigned long size = bound;
    int failed =
        tjCompress2(handle, pixels, image->width, 0, image->height, grey ? TJPF_GRAY : TJPF_RGB,
                    &jpeg, &size, sampling, image->quality, TJFLAG_NOREALLOC | TJFLAG_ACCURATEDCT);
    if (failed) shd_fail(error, SHD_INTERNAL, "", "libjpeg-turbo: %s", tjGetErrorStr2(handle));
    tjDestroy(handle);
    if (failed) return SHD_INTERNAL;

    shd_icc icc = {.size = 0};
    if (!shd_image_is_srgb(image)) icc = shd_icc_make(image);
    return assemble(jpeg, size, &icc, out, error);
}
