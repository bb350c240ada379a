/* Jobs by what is asked, so that equal ones are done once: by the bytes of their document and, once
 * they are read, by what it means. No locks: one thread at a time. */
#pragma once

typedef struct shd_job shd_job;
typedef struct shd_equals shd_equals;

shd_equals *shd_equals_new(void); /* NULL if memory is short */
void shd_equals_drop(shd_equals *equals);

/* The last one listed that is equal and has at least half of its time left at `now`: who joins it
 * can wait for it about as long as for work of their own. NULL: there is none. */
shd_job *shd_equals_by_body(const shd_equals *equals, const shd_job *like, double now);
shd_job *shd_equals_by_meaning(const shd_equals *equals, const shd_job *like, double now);

void shd_equals_list_body(shd_equals *equals, shd_job *job);
void shd_equals_list_meaning(shd_equals *equals, shd_job *job); /* after a successful read */
void shd_equals_hide(shd_equals *equals, shd_job *job);         /* from both */
