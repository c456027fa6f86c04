#include "compress/format/motion/rigid_motion_validation.h"

namespace packtrace {

std::optional<MotionFault> validate_rigid_motion(const BakedSections& sections) {
  if (!sections.rigid_motion.empty()) return MotionFault{0, "section is not empty"};
  return std::nullopt;
}

} // namespace packtrace
