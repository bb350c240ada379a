/* Numbers of documents that may be moved as a slider is, one at a time. A thread has its own. */
#ifndef SHD_ATTACK_KNOBS_H
#define SHD_ATTACK_KNOBS_H

#include <stdint.h>

/* The next documents of the thread have their knob `which` somewhere else, by `where`; -1: none. */
void knobs_move(int which, uint64_t where);

void knobs_begin(void); /* of a document */
int knobs_count(void);  /* of the document so far */

/* As between() and decades(), whose numbers they are where they are not moved. */
double knob(uint64_t *random, double low, double high);
double knob_decades(uint64_t *random, double low, double high);

/* As one_of(): a switch. What is drawn after it may be anything else then, too. */
int knob_of(uint64_t *random, int choices);

#endif
