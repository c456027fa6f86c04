#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"
#include "compress/bake/plan/requirements.h"
#include "compress/format/layout/baked_format.h"
#include "compress/format/cluster/cluster_codec.h"

namespace packtrace {

/// What became of the streams of all geometries, by stream and reason.
class RequirementTable {
public:
  /// Adds a geometry that was packed. Its stored bits count for the last of a stream's reasons.
  /// @return GeometryRecord::requirements
  uint32_t add(const Scene& scene, const GeometryPlan& plan, const GeometryNeeds& needs, const QuantizeStats& stats,
               const ClusterView::StreamBits& bits);

  /// Those that are not empty, ordered by stream and reason.
  std::vector<baked::RequirementRecord> rows() const;

private:
  std::array<std::array<baked::RequirementRecord, baked::kReasonCount>, baked::kStreamCount> rows_{};
};

} // namespace packtrace
