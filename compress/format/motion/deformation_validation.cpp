#include "compress/format/motion/deformation_validation.h"

#include <algorithm>

#include "compress/format/deformation/deformation_view.h"

namespace packtrace {

std::optional<MotionFault> validate_deformation(const BakedSections& sections) {
  const auto levels = std::ranges::partition_point(
      sections.geometries, [](const baked::GeometryRecord& g) { return (g.flags & baked::kLodLevel) == 0; });
  return find_deformation_fault(sections.deformation, sections.geometries, sections.clusters,
                                static_cast<uint32_t>(levels - sections.geometries.begin()));
}

} // namespace packtrace
