/* Who a request is from: the one word for it that fairness, stores and the log share.
 *
 *     203.0.113.7            an IPv4 address, also if IPv6 carries it (::ffff:203.0.113.7)
 *     2001:db8:0:1::/64      an IPv6 network: a single customer has all addresses of one
 *     unix                   a unix socket, whose other end has no address
 *     token:ci               who has shown a token of this name, wherever from
 *     token:1f3870be274f6c49 who has shown this token, wherever from: the start of its SHA-256
 *
 * An address is the connection's own, or, if that is one of the proxies that the operator
 * names, the one that they have added to X-Forwarded-For. Anybody may send that field: what stands
 * left of the first address that is no named proxy's is not believed. */
#pragma once

#include <stdbool.h>

#include "base/status.h"

struct sockaddr;

enum { SHD_CLIENT_SIZE = 56 };

/* Networks by their addresses. Constant once made: any thread. */
typedef struct shd_networks shd_networks;

/* "127.0.0.1, 10.0.0.0/8 2001:db8::/32 unix", or ""; SHD_CONFIG if it is no such list. */
shd_status shd_networks_new(const char *list, shd_networks **out, shd_error *error);
void shd_networks_drop(shd_networks *networks); /* NULL is fine */

/* Whether the other end of a connection is in one of them. NULL as an address is in none. */
bool shd_networks_have(const shd_networks *networks, const struct sockaddr *peer);

/* By its address ("unknown" if that is NULL, or of another family). `forwarded` is all of
 * X-Forwarded-For as one list, NULL without any. */
void shd_client_of_address(const struct sockaddr *peer, const char *forwarded,
                           const shd_networks *proxies, char out[SHD_CLIENT_SIZE]);

/* By its token's name or, if that is "", by the Authorization field in which it was right. */
void shd_client_of_token(const char *name, const char *authorization, char out[SHD_CLIENT_SIZE]);
