// A walk over everything that the active spaces, displays and views of a configuration refer to.
// OpenColorIO follows references by recursion without an end and opens any path, so this comes
// before a processor is built.
#ifndef SHD_COLOR_OCIO_WALK_HPP
#define SHD_COLOR_OCIO_WALK_HPP

#include <OpenColorIO/OpenColorIO.h>

#include <set>
#include <string>

// The files that are referred to. Throws where references go in a circle or are nested too deeply,
// and where a file is missing or is not a regular one.
std::set<std::string> shd_ocio_walk(const OCIO_NAMESPACE::ConstConfigRcPtr &config);

#endif
