#include "base/scope.h"

const char *const shd_scope_names[SHD_SCOPE_COUNT] = {[SHD_SCOPE_NONE] = "none",
                                                      [SHD_SCOPE_VECTOR] = "vectorscope",
                                                      [SHD_SCOPE_CHROMATICITY] = "chromaticity",
                                                      [SHD_SCOPE_WAVEFORM] = "waveform",
                                                      [SHD_SCOPE_PARADE] = "parade",
                                                      [SHD_SCOPE_HISTOGRAM] = "histogram",
                                                      [SHD_SCOPE_FALSECOLOR] = "falsecolor",
                                                      [SHD_SCOPE_GAMUT] = "gamut"};
