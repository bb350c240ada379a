#include "client.h"

#include <arpa/inet.h>
#include <assert.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "base/digest.h"

/* IPv4 is as IPv6 has it mapped: ::ffff:a.b.c.d (RFC 4291, section 2.5.5.2). */
typedef struct place {
    enum { UNKNOWN, UNIX, NETWORK } kind;
    unsigned char bytes[16];
} place;

typedef struct network {
    place from;
    unsigned bits; /* that count, of 128 */
} network;

struct shd_networks {
    size_t count;
    network list[];
};

static const unsigned char mapped[12] = {[10] = 0xff, [11] = 0xff};

/* ---- Addresses ---- */

static place place_of_peer(const struct sockaddr *peer) {
    place p = {.kind = UNKNOWN};
    if (peer && peer->sa_family == AF_UNIX) {
        p.kind = UNIX;
    } else if (peer && peer->sa_family == AF_INET) {
        p.kind = NETWORK;
        memcpy(p.bytes, mapped, sizeof mapped);
        memcpy(p.bytes + 12, &((const struct sockaddr_in *)(const void *)peer)->sin_addr, 4);
    } else if (peer && peer->sa_family == AF_INET6) {
        p.kind = NETWORK;
        memcpy(p.bytes, &((const struct sockaddr_in6 *)(const void *)peer)->sin6_addr, 16);
    }
    return p;
}

/* "192.0.2.1" or "2001:db8::1"; UNKNOWN if it is neither. */
static place place_of_text(const char *text) {
    place p = {.kind = NETWORK};
    if (inet_pton(AF_INET6, text, p.bytes) == 1) return p;
    memcpy(p.bytes, mapped, sizeof mapped);
    if (inet_pton(AF_INET, text, p.bytes + 12) != 1) p.kind = UNKNOWN;
    return p;
}

static void write_client(const place *p, char out[SHD_CLIENT_SIZE]) {
    if (p->kind != NETWORK) {
        strcpy(out, p->kind == UNIX ? "unix" : "unknown");
    } else if (!memcmp(p->bytes, mapped, sizeof mapped)) {
        inet_ntop(AF_INET, p->bytes + 12, out, SHD_CLIENT_SIZE);
    } else {
        unsigned char half[16] = {0};
        memcpy(half, p->bytes, 8);
        inet_ntop(AF_INET6, half, out, SHD_CLIENT_SIZE);
        strcat(out, "/64");
    }
}

/* ---- Networks ---- */

static bool lies_in(const place *p, const network *n) {
    if (p->kind != n->from.kind || p->kind == UNKNOWN) return false;
    unsigned whole = n->bits / 8, rest = n->bits % 8;
    if (memcmp(p->bytes, n->from.bytes, whole) != 0) return false;
    return !rest || !((p->bytes[whole] ^ n->from.bytes[whole]) >> (8 - rest));
}

static bool is_in_one(const shd_networks *networks, const place *p) {
    for (size_t i = 0; networks && i < networks->count; i++)
        if (lies_in(p, &networks->list[i])) return true;
    return false;
}

bool shd_networks_have(const shd_networks *networks, const struct sockaddr *peer) {
    place p = place_of_peer(peer);
    return is_in_one(networks, &p);
}

/* "ADDR" or "ADDR/BITS". */
static bool parse_network(char *text, network *out) {
    char *slash = strchr(text, '/');
    *out = (network){.from.kind = UNIX};
    if (!strcmp(text, "unix")) return true;
    if (slash) *slash = 0;
    out->from = place_of_text(text);
    unsigned most = strchr(text, ':') ? 128 : 32;
    unsigned long bits = slash ? strtoul(slash + 1, NULL, 10) : most;
    bool digits = !slash || (slash[1] && !slash[1 + strspn(slash + 1, "0123456789")]);
    out->bits = (unsigned)bits + 128 - most;
    return out->from.kind != UNKNOWN && digits && bits <= most;
}

shd_status shd_networks_new(const char *list, shd_networks **out, shd_error *error) {
    static const char blanks[] = " ,\t";
    size_t most = strlen(list) / 2 + 1; /* the shortest is "::" and a blank */
    shd_networks *networks = calloc(1, sizeof *networks + most * sizeof networks->list[0]);
    if (!networks) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for networks");
    for (list += strspn(list, blanks); *list; list += strspn(list, blanks)) {
        char text[64];
        const size_t length = strcspn(list, blanks);
        assert(networks->count < most);
        snprintf(text, sizeof text, "%.*s", (int)length, list);
        if (length >= sizeof text || !parse_network(text, &networks->list[networks->count++])) {
            free(networks);
            return shd_fail(error, SHD_CONFIG, "trusted-proxies",
                            "'%.*s' is no address, no network such as 10.0.0.0/8, and not unix",
                            (int)length, list);
        }
        list += length;
    }
    *out = networks;
    return SHD_OK;
}

void shd_networks_drop(shd_networks *networks) {
    free(networks);
}

/* ---- Clients ---- */

/* One entry of X-Forwarded-For; some have a port ("192.0.2.1:80", "[2001:db8::1]:80") or quotes. */
static place place_of_entry(const char *start, size_t length) {
    char text[64];
    while (length && strchr(" \t\"[", *start)) start++, length--;
    while (length && strchr(" \t\"", start[length - 1])) length--;
    if (!length || length >= sizeof text) return (place){.kind = UNKNOWN};
    memcpy(text, start, length);
    text[length] = 0;
    char *bracket = strchr(text, ']'), *colon = strchr(text, ':');
    if (bracket)
        *bracket = 0;
    else if (colon && !strchr(colon + 1, ':'))
        *colon = 0;
    return place_of_text(text);
}

/* From the right, where the nearest proxy has written: past those that are named, to the first that
 * is not, or as far as there are addresses. */
void shd_client_of_address(const struct sockaddr *peer, const char *forwarded,
                           const shd_networks *proxies, char out[SHD_CLIENT_SIZE]) {
    place client = place_of_peer(peer);
    size_t end = forwarded ? strlen(forwarded) : 0;
    while (end && is_in_one(proxies, &client)) {
        size_t start = end;
        while (start && forwarded[start - 1] != ',') start--;
        place before = place_of_entry(forwarded + start, end - start);
        if (before.kind == UNKNOWN) break;
        client = before;
        end = start ? start - 1 : 0;
    }
    write_client(&client, out);
}

void shd_client_of_token(const char *name, const char *authorization, char out[SHD_CLIENT_SIZE]) {
    enum { TOLD = 16 };
    if (*name) {
        snprintf(out, SHD_CLIENT_SIZE, "token:%s", name);
        return;
    }
    const char *token = authorization + strcspn(authorization, " ");
    token += strspn(token, " ");
    const shd_digest digest = shd_digest_of(token, strlen(token));
    char digits[SHD_DIGEST_TEXT];
    shd_digest_write(&digest, digits);
    snprintf(out, SHD_CLIENT_SIZE, "token:%.*s", TOLD, digits);
}
