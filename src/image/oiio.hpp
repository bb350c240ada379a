/* What the files of the module shaded_oiio.so share. C++ alone. */
#pragma once

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <new>
#include <stdexcept>

#include "image/oiio.h"

inline OIIO::TypeDesc stored_type(shd_depth depth) {
    return depth == SHD_U8     ? OIIO::TypeDesc::UINT8
           : depth == SHD_U16  ? OIIO::TypeDesc::UINT16
           : depth == SHD_HALF ? OIIO::TypeDesc::HALF
                               : OIIO::TypeDesc::FLOAT;
}

/* Thrown where whoever called is asked whether to go on, and says no. */
struct Stopped {};

/* -1, and a sentence of one line. */
inline int tell_failure(char *text, size_t size, const char *what) {
    std::snprintf(text, size, "OpenImageIO: %s", what);
    std::replace(text, text + std::strlen(text), '\n', ' ');
    return -1;
}

/* What `action` returns, or what it throws as oiio.h has it: -1 and a sentence, 1: out of memory,
 * 2: Stopped. `same`: caller and module are of one build. */
template <class Action> int shielded(bool same, char *text, size_t size, const Action &action) {
    if (!same) return tell_failure(text, size, "the module is of another build");
    try {
        return action();
    } catch (const Stopped &) {
        return 2;
    } catch (const std::bad_alloc &) {
        return 1;
    } catch (const std::exception &e) {
        return tell_failure(text, size, e.what());
    } catch (...) {
        return tell_failure(text, size, "an unknown exception");
    }
}
