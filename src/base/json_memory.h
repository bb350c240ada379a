/* Whether jansson had the memory that it asked for.
 *
 * Jansson does not tell: if the system refuses memory, a document that it reads ends in a syntax
 * error, and a document that it builds lacks members. So it allocates through here. */
#pragma once

#include <stdbool.h>

/* Begins a piece of work with jansson on the calling thread. The thread must ask below before it
 * renders: between tiles it may run other jobs, which begin work of their own. The first call sets
 * what the whole process uses for jansson's memory, which stays interchangeable with malloc and
 * free. */
void shd_json_memory_watch(void);

/* Whether memory was refused on this thread since the last watch. */
bool shd_json_memory_short(void);
