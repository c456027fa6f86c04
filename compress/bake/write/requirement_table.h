#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"
#include "compress/bake/plan/requirements.h"
#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/layout/baked_format.h"

namespace packtrace {

/// Which streams of all geometries were stored or left out, by stream and reason.
class RequirementTable {
public:
  /// Adds a packed geometry. The stored bits of a stream count for the last reason that the geometry has for it.
  /// @return GeometryRecord::requirements
  uint32_t add(const Scene& scene, const GeometryPlan& plan, const GeometryNeeds& needs, const QuantizeStats& stats,
               const ClusterView::StreamBits& bits);

  /// The nonempty rows, ordered by stream and reason.
  std::vector<baked::RequirementRecord> rows() const;

private:
  std::array<std::array<baked::RequirementRecord, baked::kReasonCount>, baked::kStreamCount> rows_{};
};

} // namespace packtrace
