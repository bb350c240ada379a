/* What the fuzz targets share. Each target is one file with LLVMFuzzerTestOneInput: linked with
 * libFuzzer in build/fuzz, and with replay.c in every other build, which runs kept inputs. */
#ifndef SHD_TEST_FUZZ_H
#define SHD_TEST_FUZZ_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* A claim that no input may break. */
#define CHECK(claim)                                                                               \
    do {                                                                                           \
        if (!(claim)) {                                                                            \
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #claim);                    \
            abort();                                                                               \
        }                                                                                          \
    } while (0)

#endif
