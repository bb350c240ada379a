/* Marks memory whose use AddressSanitizer shall report; does nothing in other builds. */
#pragma once

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SHD_ASAN 1
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define SHD_ASAN 1
#endif
#ifdef SHD_ASAN
#include <sanitizer/asan_interface.h>
#else
#define ASAN_POISON_MEMORY_REGION(at, size)   ((void)(at), (void)(size))
#define ASAN_UNPOISON_MEMORY_REGION(at, size) ((void)(at), (void)(size))
#endif
