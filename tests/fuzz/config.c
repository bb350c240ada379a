/* What operators write: "FILE \0 FLAG \0 FLAG ...". The file is read as a configuration and as a
 * list of tokens, of which the flags are tried as Authorization fields too. */
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "fuzz.h"
#include "server/access/access.h"
#include "server/access/client.h"
#include "server/access/tokens.h"
#include "server/ops/config.h"

enum { FLAGS_MOST = 16 };

/* In memory, under a name that programs can open. */
static const char *make_file(const uint8_t *data, size_t size) {
    static char path[64];
    static int file = -1;
    if (file < 0) {
        file = memfd_create("config", 0);
        snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    }
    CHECK(file >= 0 && !ftruncate(file, 0) && pwrite(file, data, size, 0) == (ssize_t)size);
    return path;
}

static bool is_text(const char *field, size_t size) {
    size_t length = strnlen(field, size);
    for (size_t i = 0; i < length; i++)
        if (field[i] < 0x20 || field[i] > 0x7e) return false;
    return length < size;
}

static void check_config(int count, char **flags) {
    char message[1024] = "", kept[256];
    shd_config config, defaults = shd_config_defaults();
    shd_config_result result = shd_config_read(count, flags, &config, message, sizeof message);
    CHECK(strnlen(message, sizeof message) < sizeof message);
    if (result == SHD_CONFIG_BAD || result == SHD_CONFIG_BAD_FLAGS) CHECK(*message);
    if (result != SHD_CONFIG_RUN) return;
    CHECK(is_text(config.listen, sizeof config.listen));
    CHECK(is_text(config.ocio, sizeof config.ocio));
    CHECK(is_text(config.cors_origins, sizeof config.cors_origins));
    CHECK(config.threads <= 1024 && config.queue >= 1 && config.timeout >= 1 &&
          config.limits.body >= 1);
    shd_config_keep(&config, &defaults, kept, sizeof kept);
    CHECK(!strcmp(config.listen, defaults.listen) && config.threads == defaults.threads);
    shd_networks *proxies;
    if (shd_networks_new(config.trusted_proxies, &proxies, NULL) == SHD_OK) {
        char client[SHD_CLIENT_SIZE];
        shd_client_of_address(NULL, config.cors_origins, proxies, client);
        shd_networks_drop(proxies);
    }
    char *origins;
    if (shd_origins_list(config.cors_origins, &origins, NULL) == SHD_OK) {
        CHECK(strlen(origins) <= 2 * strlen(config.cors_origins));
        shd_origins_admit(config.cors_origins, "https://a.example");
        free(origins);
    }
}

static void check_tokens(const char *path, int count, char **fields) {
    shd_keys *keys = NULL;
    if (shd_keys_load(path, &keys, NULL) == SHD_OK)
        for (int i = 0; i < count; i++) CHECK(!shd_keys_signed(keys, "/", 1, fields[i]));
    shd_keys_drop(keys);
    shd_tokens *tokens;
    shd_quotas *quotas = shd_quotas_new();
    CHECK(quotas);
    const shd_status status = shd_tokens_load(path, quotas, &tokens, NULL);
    if (status != SHD_OK) {
        shd_quotas_drop(quotas);
        return;
    }
    CHECK(!shd_tokens_admit(tokens, NULL) && !shd_tokens_admit(tokens, "Bearer "));
    for (int i = 0; i < count; i++) {
        const shd_token *token = shd_tokens_admit(tokens, fields[i]);
        if (token && token->quota)
            CHECK(shd_quota_take(quotas, token->quota, token->rate, i) <= token->rate.seconds);
    }
    shd_tokens_drop(tokens);
    shd_quotas_drop(quotas);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const uint8_t *zero = size ? memchr(data, 0, size) : NULL;
    size_t length = zero ? (size_t)(zero - data) : size, rest = zero ? size - length - 1 : 0;
    const char *path = make_file(data, length);
    char *text = malloc(rest + 1);
    CHECK(text);
    if (rest) memcpy(text, zero + 1, rest);
    text[rest] = 0;

    char program[] = "shaded", config[] = "--config";
    char *flags[FLAGS_MOST + 4] = {program, config, (char *)(size_t)path};
    int count = 3;
    for (char *flag = text; flag < text + rest && count < FLAGS_MOST; flag += strlen(flag) + 1)
        /* No other file: there are some that never end. */
        if (strncmp(flag, "--con", 5)) flags[count++] = flag;
    check_tokens(path, count - 3, flags + 3);
    check_config(count, flags);
    free(text);
    return 0;
}
