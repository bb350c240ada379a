/* Whether jansson had the memory that it asked for. It does not tell: a document that it reads ends
 * in a syntax error, and one that it builds lacks members. So it allocates through here. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

/* Begins a piece of work with jansson on the calling thread. The thread must ask below before it
 * renders: between tiles it may run other jobs, which begin work of their own. Jansson's memory,
 * the whole process's from the first call on, stays interchangeable with malloc and free. */
void shd_json_memory_watch(void);

/* Whether memory was refused on this thread since the last watch. */
bool shd_json_memory_short(void);

/* From here on until shd_json_memory_leave, on this thread, what jansson allocates lies in `block`,
 * until that is full: it then gets no more, which is not told above. What it frees meanwhile is not
 * used again. Nothing of what lies there is freed alone later: the block is, as a whole. */
void shd_json_memory_enter(void *block, size_t size);
void shd_json_memory_leave(void);
