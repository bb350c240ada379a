// What a configuration refers to.

#include <sys/stat.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "color/ocio.hpp"

namespace {

constexpr size_t max_reference_depth = 64;

class Walk {
  public:
    Walk(const OCIO::ConstConfigRcPtr &config, bool archived)
        : config_(config), context_(config->getCurrentContext()), archived_(archived) {}

    void space(const char *name) {
        const char *resolved = context_->resolveStringVar(name);
        OCIO::ConstColorSpaceRcPtr found = config_->getColorSpace(resolved);
        if (!found) return named(resolved);
        node("color space '" + std::string(found->getName()) + "'", [&] {
            transform(found->getTransform(OCIO::COLORSPACE_DIR_TO_REFERENCE));
            transform(found->getTransform(OCIO::COLORSPACE_DIR_FROM_REFERENCE));
        });
    }

    void view(const char *display, const char *name) {
        node("view '" + std::string(display) + " / " + name + "'", [&] {
            const char *target = config_->getDisplayViewColorSpaceName(display, name);
            space(std::strcmp(target, OCIO::OCIO_VIEW_USE_DISPLAY_NAME) ? target : display);
            const char *through = config_->getDisplayViewTransformName(display, name);
            if (*through) view_transform(config_->getViewTransform(through));
            looks(config_->getDisplayViewLooks(display, name));
        });
    }

    // Between the scene's and the displays' reference spaces.
    void bridge() { view_transform(config_->getDefaultSceneToDisplayViewTransform()); }

    const std::set<std::string> &files() const { return files_; }

  private:
    template <typename Body> void node(const std::string &key, Body body) {
        if (done_.count(key)) return;
        for (size_t i = 0; i < path_.size(); i++)
            if (path_[i] == key) throw std::runtime_error("circular definition: " + chain(i, key));
        if (path_.size() >= max_reference_depth)
            throw std::runtime_error("references are nested too deeply at " + key);
        path_.push_back(key);
        body();
        path_.pop_back();
        done_.insert(key);
    }

    std::string chain(size_t from, const std::string &last) const {
        std::string out;
        for (size_t i = from; i < path_.size(); i++) out += path_[i] + " -> ";
        return out + last;
    }

    void named(const char *name) {
        OCIO::ConstNamedTransformRcPtr found = config_->getNamedTransform(name);
        if (!found) return; // OpenColorIO says so when it builds
        node("named transform '" + std::string(found->getName()) + "'", [&] {
            transform(found->getTransform(OCIO::TRANSFORM_DIR_FORWARD));
            transform(found->getTransform(OCIO::TRANSFORM_DIR_INVERSE));
        });
    }

    void view_transform(const OCIO::ConstViewTransformRcPtr &found) {
        if (!found) return;
        node("view transform '" + std::string(found->getName()) + "'", [&] {
            transform(found->getTransform(OCIO::VIEWTRANSFORM_DIR_TO_REFERENCE));
            transform(found->getTransform(OCIO::VIEWTRANSFORM_DIR_FROM_REFERENCE));
        });
    }

    // "+look, -look | fallback": signs are directions, and a look may be an empty word.
    void looks(const char *text) {
        std::string names(text);
        for (size_t at = 0; at < names.size();) {
            size_t begin = names.find_first_not_of(",:|+- \t", at);
            if (begin == std::string::npos) return;
            size_t end = std::min(names.find_first_of(",:|", begin), names.size());
            at = end;
            while (end > begin && (names[end - 1] == ' ' || names[end - 1] == '\t')) end--;
            OCIO::ConstLookRcPtr look = config_->getLook(names.substr(begin, end - begin).c_str());
            if (!look) continue;
            node("look '" + std::string(look->getName()) + "'", [&] {
                space(look->getProcessSpace());
                transform(look->getTransform());
                transform(look->getInverseTransform());
            });
        }
    }

    void convert(const char *from, const char *to) {
        space(from);
        space(to);
        OCIO::ConstColorSpaceRcPtr a = config_->getColorSpace(context_->resolveStringVar(from));
        OCIO::ConstColorSpaceRcPtr b = config_->getColorSpace(context_->resolveStringVar(to));
        if (a && b && a->getReferenceSpaceType() != b->getReferenceSpaceType()) bridge();
    }

    void file(const char *source) {
        if (archived_) return; // inside of the archive, which is one file for the digest
        std::string path = context_->resolveFileLocation(source); // throws if it is missing
        struct stat info;
        if (stat(path.c_str(), &info) || !S_ISREG(info.st_mode))
            throw std::runtime_error("'" + path + "' is not a regular file");
        files_.insert(path);
    }

    void transform(const OCIO::ConstTransformRcPtr &t) {
        using namespace OCIO;
        if (!t) return;
        if (auto group = DynamicPtrCast<const GroupTransform>(t)) {
            for (int i = 0; i < group->getNumTransforms(); i++) transform(group->getTransform(i));
        } else if (auto color = DynamicPtrCast<const ColorSpaceTransform>(t)) {
            convert(color->getSrc(), color->getDst());
        } else if (auto look = DynamicPtrCast<const LookTransform>(t)) {
            convert(look->getSrc(), look->getDst());
            looks(look->getLooks());
        } else if (auto shown = DynamicPtrCast<const DisplayViewTransform>(t)) {
            space(shown->getSrc());
            view(shown->getDisplay(), shown->getView());
        } else if (auto lut = DynamicPtrCast<const FileTransform>(t)) {
            file(lut->getSrc());
        }
    }

    OCIO::ConstConfigRcPtr config_;
    OCIO::ConstContextRcPtr context_;
    bool archived_;
    std::vector<std::string> path_; // nodes that are being visited, outermost first
    std::set<std::string> done_, files_;
};

} // namespace

std::set<std::string> shd_ocio_walk(const OCIO::ConstConfigRcPtr &config, bool archived) {
    Walk walk(config, archived);
    for (const OCIO::ConstColorSpaceRcPtr &space : shd_ocio_spaces(config)) {
        walk.space(space->getName());
        if (space->getReferenceSpaceType() == OCIO::REFERENCE_SPACE_DISPLAY) walk.bridge();
    }
    for (int i = 0; i < config->getNumDisplays(); i++)
        for (int j = 0; j < config->getNumViews(config->getDisplay(i)); j++)
            walk.view(config->getDisplay(i), config->getView(config->getDisplay(i), j));
    return walk.files();
}
