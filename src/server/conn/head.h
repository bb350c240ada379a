/* The head of a request: its target and its fields, and whether all servers on its way read them
 * alike. On the I/O thread. */
#pragma once

#include "server/exchange.h"

/* What the head says of its body and of itself. */
typedef struct shd_head {
    shd_exchange *exchange;
    const char *length, *transfer_coding, *request_id, *trace; /* NULL: there is none */
    unsigned lengths, transfer_codings, hosts, types, authorizations, traces; /* times given */
    bool expects, blanks;
} shd_head;

/* "/path?query" of itself or of "http://host/path?query". */
const char *shd_head_skip_authority(const char *target);

/* The exchange's path, decoded but for "%2F" and "%00", which parts of a server may take for the
 * end of a segment or of the path. An over-long path leaves path_cut set: it names nothing. */
void shd_head_set_path(shd_exchange *exchange, const char *target);

/* Method, fields and id, into the exchange. */
void shd_head_read(shd_exchange *exchange, const char *method, shd_head *head);

/* Heads on which two servers could disagree where the body ends, or what it is, are refused: that
 * is how requests are smuggled past proxies (RFC 9112, section 11.2). False: with a reply. */
bool shd_head_check(const shd_head *head, const char *version);
