#pragma once

#include <optional>

#include "compress/format/file/baked_file.h"
#include "compress/format/motion/motion_fault.h"

namespace packtrace {

/// Checks the keys of moving instances and cameras. Relies on the check of instances and cameras.
std::optional<MotionFault> validate_rigid_motion(const BakedSections& sections);

} // namespace packtrace
