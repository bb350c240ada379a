/* Whether jansson had the memory that it asked for. It does not tell: a document that it reads ends
 * in a syntax error, and one that it builds lacks members. So it allocates through here. */
#pragma once

#include <stdbool.h>

/* Begins a piece of work with jansson on the calling thread. The thread must ask below before it
 * renders: between tiles it may run other jobs, which begin work of their own. Jansson's memory,
 * the whole process's from the first call on, stays interchangeable with malloc and free. */
void shd_json_memory_watch(void);

/* Whether memory was refused on this thread since the last watch. */
bool shd_json_memory_short(void);
