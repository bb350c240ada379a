#include "base/catalog.h"

#include <string.h>
#include <strings.h>

const shd_space_info *shd_catalog_space(const shd_catalog *catalog, const char *name) {
    for (size_t i = 0; i < catalog->space_count; i++)
        if (!strcasecmp(catalog->spaces[i].name, name)) return &catalog->spaces[i];
    for (size_t i = 0; i < catalog->space_count; i++)
        for (size_t k = 0; k < catalog->spaces[i].alias_count; k++)
            if (!strcasecmp(catalog->spaces[i].aliases[k], name)) return &catalog->spaces[i];
    return NULL;
}

const shd_display_info *shd_catalog_display(const shd_catalog *catalog, const char *name) {
    for (size_t i = 0; i < catalog->display_count; i++)
        if (!strcmp(catalog->displays[i].name, name)) return &catalog->displays[i];
    return NULL;
}

const char *const *shd_channel_names(shd_channels channels) {
    static const char *const names[][3] = {
        [SHD_RGB] = {"R", "G", "B"}, [SHD_XYZ] = {"X", "Y", "Z"}, [SHD_YIQ] = {"Y", "I", "Q"},
        [SHD_HSV] = {"H", "S", "V"}, [SHD_LAB] = {"L", "a", "b"}, [SHD_LCH] = {"L", "C", "h"}};
    return names[channels];
}
