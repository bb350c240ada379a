/* Programs with sanitizers take several times as long: what repeats for the sake of figures, and
 * not of code that only some inputs reach, does so less. */
#ifndef SHD_TESTS_SANITIZED_H
#define SHD_TESTS_SANITIZED_H

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { SHD_SANITIZED = 1 };
#else
enum { SHD_SANITIZED = 0 };
#endif

#endif
