#pragma once

#include <optional>

#include "compress/format/file/baked_file.h"
#include "compress/format/motion/motion_fault.h"

namespace packtrace {

/// Checks the section of meshes whose vertices move (find_deformation_fault()).
std::optional<MotionFault> validate_deformation(const BakedSections& sections);

} // namespace packtrace
