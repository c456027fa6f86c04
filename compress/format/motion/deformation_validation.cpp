#include "compress/format/motion/deformation_validation.h"

namespace packtrace {

std::optional<MotionFault> validate_deformation(const BakedSections& sections) {
  if (!sections.deformation.empty()) return MotionFault{0, "section is not empty"};
  return std::nullopt;
}

} // namespace packtrace
