/* Runs a fuzz target over files, and over the files of folders, without libFuzzer:
 *     fuzz_scene tests/fuzz/regressions/scene api/examples/smallest.json
 * A folder that is not there holds nothing. */
#include <dirent.h>
#include <errno.h>
#include <string.h>

#include "fuzz.h"

static size_t runs;

static void run_file(const char *path) {
    FILE *file = fopen(path, "rb");
    CHECK(file && !fseek(file, 0, SEEK_END));
    long size = ftell(file);
    rewind(file);
    /* Of the exact size, so that AddressSanitizer sees every byte read past its end. */
    uint8_t *data = malloc(size > 0 ? (size_t)size : 1);
    CHECK(data && size >= 0 && fread(data, 1, (size_t)size, file) == (size_t)size);
    fclose(file);
    fprintf(stderr, "%s\n", path);
    LLVMFuzzerTestOneInput(data, (size_t)size);
    free(data);
    runs++;
}

static void run_folder(DIR *folder, const char *path) {
    for (struct dirent *entry; (entry = readdir(folder));) {
        char file[4096];
        if (*entry->d_name == '.') continue;
        CHECK(snprintf(file, sizeof file, "%s/%s", path, entry->d_name) < (int)sizeof file);
        run_file(file);
    }
    closedir(folder);
}

int main(int argc, char **argv) {
    for (int i = 1; i < argc; i++) {
        DIR *folder = opendir(argv[i]);
        if (folder)
            run_folder(folder, argv[i]);
        else if (errno != ENOENT)
            run_file(argv[i]);
    }
    printf("%zu inputs\n", runs);
    return runs ? 0 : 1;
}
