/* Whether pictures are the same that are said to be: of a scene whose numbers are moved one at a
 * time, as sliders are, and whose budget becomes wide and narrow, with what earlier ones have left
 * and without, on one thread and on two, by the widest kernel and by the portable one; and a region
 * of it. A thread has its own. */
#ifndef SHD_ATTACK_SAME_H
#define SHD_ATTACK_SAME_H

#include <stdint.h>

#include "attack/scenes.h"

typedef struct same_maker same_maker;

/* What is told of a finding: a line, and the document. */
typedef void same_teller(void *context, const char *line, const char *json);

same_maker *same_new(void); /* NULL: memory, or pictures are not read */
void same_drop(same_maker *s);

/* The number of pictures that were made. */
uint64_t same_check(same_maker *s, const family *f, uint64_t seed, same_teller *tell,
                    void *context);

#endif
