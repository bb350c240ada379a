/* How samples encode light. Pure functions, any thread. */
#ifndef SHD_BASE_TRANSFER_H
#define SHD_BASE_TRANSFER_H

#ifdef __cplusplus
extern "C" {
#endif

typedef enum shd_transfer {
    SHD_TRANSFER_UNKNOWN,
    SHD_TRANSFER_LINEAR,
    SHD_TRANSFER_SRGB,   /* IEC 61966-2-1, which Display P3 uses too */
    SHD_TRANSFER_REC1886 /* gamma 2.4 */
} shd_transfer;

/* The curve in f64: encoded from linear light, and back. Both directions are odd functions, 0 at 0
 * and 1 at 1. SHD_TRANSFER_UNKNOWN counts as linear. */
double shd_curve_encode(shd_transfer transfer, double linear);
double shd_curve_decode(shd_transfer transfer, double encoded);

#ifdef __cplusplus
}
#endif
#endif
