/* Who may keep an answer: an answer to a token is its client's alone, and one to a link that
 * expires is nobody's for longer than the link. */
#pragma once

#include <stdbool.h>

#include "server/answer/reply.h"

enum { SHD_POLICY_SIZE = 512 };

/* A Cache-Control field (RFC 9111, section 5.2.2) of up to 255 characters, made private: what
 * speaks of shared caches, or lets an answer outlive its age, is left out. With left >= 0 the age
 * is at most so many seconds, and nothing is used after it without asking. */
void shd_private_policy(const char *policy, long long left, char out[SHD_POLICY_SIZE]);

/* Does so to the reply, unless it is an error, to a request that came with a token, or by a link
 * that expires (seconds since 1970; 0: never), and adds to Vary what it depends on then. */
void shd_private_apply(shd_reply *reply, bool has_token, long long expires);
