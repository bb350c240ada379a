/* Finished pictures, kept for those who ask for the same ones.
 *
 * An answer is found by its entity tag, the digest of all that decides its bytes; or, before
 * anything is read, by the question that last had this answer: the document's bytes as they were
 * sent, compared one by one, if they are few.
 *
 * Answers are constant, live while somebody holds their bytes, and are forgotten in the order of
 * their last use when the cap is reached. What is forgotten while it is being sent is freed when it
 * is sent. Any thread. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/format.h"
#include "base/status.h"
#include "reply.h"
#include "server/conn/inflate.h"

typedef struct shd_cache shd_cache;

/* All that decides the answer to a request for a picture. */
typedef struct shd_question {
    unsigned char *body; /* the document as it was sent; NULL if size is 0 */
    size_t size;
    shd_coding coding;   /* of the body */
    shd_format fallback; /* what Accept makes of a document that names no format */
    bool picture_accepted;
    bool is_link;      /* the format is the path's: the document may not ask for another one */
    bool is_digest;    /* the body is the digest of a document that is kept */
    uint64_t settings; /* shd_settings.number: limits and colors */
} shd_question;

/* Questions of one kind differ by their bodies alone. Odd. */
uint64_t shd_question_kind(const shd_question *question);

/* How an answer came about: the value of Cache-Status (RFC 9211). */
typedef enum shd_cached {
    SHD_CACHE_OFF, /* there is no cache, or it was not asked */
    SHD_CACHE_HIT,
    SHD_CACHE_STORED, /* a miss, kept for the next one */
    SHD_CACHE_MISS    /* a miss that is too large, or finds no memory */
} shd_cached;

/* An entity tag's digits and a 0. */
enum { SHD_TAG_SIZE = 33 };

/* `cap` bytes at most, answers and what finds them; 0 keeps nothing. What finds them is counted in
 * `budget`, which outlives it, answers' bodies are already. */
shd_status shd_cache_new(size_t cap, shd_budget *budget, shd_cache **out, shd_error *error);
void shd_cache_drop(shd_cache *cache); /* NULL is fine */

/* The answer with this tag, copied into an empty reply; its bytes are shared. The question, unless
 * it is NULL, finds it from now on. SHD_CACHE_HIT; SHD_CACHE_MISS; SHD_CACHE_OFF if cap is 0. */
shd_cached shd_cache_find(shd_cache *cache, const char *tag, const shd_question *question,
                          shd_reply *reply);

/* The same by the question alone; also tells the tag. */
shd_cached shd_cache_ask(shd_cache *cache, const shd_question *question, char tag[SHD_TAG_SIZE],
                         shd_reply *reply);

/* Keeps a reply that nobody shares yet; `question` as above. Not kept, SHD_CACHE_MISS, is what is
 * above an eighth of the cap, so that one picture does not cost many. An answer that is there under
 * this tag already is the same one, and stays: SHD_CACHE_STORED. */
shd_cached shd_cache_put(shd_cache *cache, const char *tag, const shd_question *question,
                         shd_reply *reply);

/* Forgets the oldest answers until `bytes` of memory are free for it or none is left. Returns how
 * many are. */
size_t shd_cache_trim(shd_cache *cache, size_t bytes);

typedef struct shd_cache_load {
    size_t bytes, entries;
    uint64_t evictions; /* answers forgotten for lack of room */
} shd_cache_load;

shd_cache_load shd_cache_load_of(shd_cache *cache);
