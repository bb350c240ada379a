/* What an output may show instead of its picture: scopes of what it displays. */
#pragma once

typedef enum shd_scope {
    SHD_SCOPE_NONE,
    SHD_SCOPE_VECTOR,       /* chroma on NTSC's axes I and Q */
    SHD_SCOPE_CHROMATICITY, /* CIE 1976 u'v' */
    SHD_SCOPE_WAVEFORM,     /* luma by columns of the picture */
    SHD_SCOPE_PARADE,       /* each channel by columns, side by side */
    SHD_SCOPE_HISTOGRAM,
    SHD_SCOPE_FALSECOLOR, /* the picture, colored by stops around a mid grey of 0.18 */
    SHD_SCOPE_GAMUT,      /* the picture, marked where it is out of gamut or not finite */
    SHD_SCOPE_COUNT
} shd_scope;

/* As documents have them; that of SHD_SCOPE_NONE is "none". */
extern const char *const shd_scope_names[SHD_SCOPE_COUNT];
