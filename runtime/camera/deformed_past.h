#pragma once

#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {

/// The vertices of deforming geometry in the frame before, for motion vectors (PreviousFrame::surfaces).
class DeformedPast final : public SurfaceHistory {
public:
  /// @param tracer must outlive this object
  explicit DeformedPast(const PackedTracer& tracer) : tracer_(tracer) {}

  std::optional<DVec3> previous_position(uint32_t instance, uint32_t triangle, glm::dvec2 barycentrics) const override {
    return tracer_.previous_position(instance, triangle, barycentrics);
  }

private:
  const PackedTracer& tracer_;
};

} // namespace packtrace
