#include "color/ocio.hpp"

#include <strings.h>

#include <algorithm>
#include <cstring>

#include "color/text.h"

std::string shd_ocio_sentence(const char *text) {
    bool clean = shd_color_is_text(text);
    std::string out;
    for (; *text; text++) {
        unsigned char byte = static_cast<unsigned char>(*text);
        if (byte > ' ')
            out += clean || byte < 0x7f ? *text : '?';
        else if (!out.empty() && out.back() != ' ')
            out += ' ';
    }
    while (!out.empty() && (out.back() == ' ' || out.back() == '.')) out.pop_back();
    return out;
}

std::vector<OCIO::ConstColorSpaceRcPtr> shd_ocio_spaces(const OCIO::ConstConfigRcPtr &config) {
    std::vector<OCIO::ConstColorSpaceRcPtr> spaces;
    for (int i = 0; i < config->getNumColorSpaces(); i++)
        spaces.push_back(config->getColorSpace(config->getColorSpaceNameByIndex(i)));
    for (int i = 0; i < config->getNumRoles(); i++)
        if (OCIO::ConstColorSpaceRcPtr named = config->getColorSpace(config->getRoleName(i)))
            if (std::find(spaces.begin(), spaces.end(), named) == spaces.end())
                spaces.push_back(named);
    return spaces;
}

OCIO::ConstColorSpaceRcPtr shd_ocio_target(const OCIO::ConstConfigRcPtr &ocio, const char *display,
                                           const char *view) {
    const char *name = ocio->getDisplayViewColorSpaceName(display, view);
    return ocio->getColorSpace(std::strcmp(name, OCIO::OCIO_VIEW_USE_DISPLAY_NAME) ? name
                                                                                   : display);
}

shd_channels shd_ocio_channels(const OCIO::ConstColorSpaceRcPtr &space) {
    static const struct {
        const char *category;
        shd_channels channels;
    } known[] = {{"xyz", SHD_XYZ}, {"yiq", SHD_YIQ}, {"hsv", SHD_HSV}, {"lab", SHD_LAB}};
    for (const auto &kind : known)
        if (space->hasCategory(kind.category)) return kind.channels;
    return SHD_RGB;
}

bool shd_ocio_is_linear(const OCIO::ConstColorSpaceRcPtr &space) {
    return !space->isData() && !strcasecmp(space->getEncoding(), "scene-linear");
}
