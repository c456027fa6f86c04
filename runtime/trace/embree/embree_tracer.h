#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "pbrt_import/base/memory_budget.h"
#include "runtime/trace/ray_tracer.h"

struct RTCSceneTy;

namespace packtrace {

enum class BvhQuality : uint8_t {
  kMedium, ///< deterministic
  kHigh,   ///< spatial splits: slower to build, faster to trace; the tree may differ from build to build
};

struct EmbreeConfig {
  BvhQuality quality = BvhQuality::kMedium;
  /// Watertight: no ray passes between two triangles that share an edge. Without, about one camera ray in 40,000 does
  /// on finely tessellated surfaces and leaves a dot; tracing is up to a fifth faster then, and kHigh splits in space.
  bool robust = true;
  bool compact = false; ///< smaller and slower trees
  /// Pays for vertices, indices and trees; no limit without one.
  std::optional<MemoryBudget> memory;
};

/// Traces one SceneSource with Embree 3: float triangles decoded once, and Embree's trees over them.
///
/// Coherent closest hits go as packets of 16 with Embree's coherent flag, all else as streams with the incoherent one:
/// on each kind of ray the other flag costs a factor of two to four (docs/tracing.md).
///
/// Rays live in a unit space (space()), a power-of-two scale and a translation away from the world, so that scenes of
/// any scale between 1e-30 and 1e30 work. Geometries that are placed once and untransformed share it; all others have
/// a unit space of their own and are Embree instances. Placements that float arithmetic cannot invert (flattening, or
/// vastly smaller than the scene) are traced as moved copies instead.
/// Per geometry there is one RTCGeometry for each combination of camera_visible, occludes and needs_mask, so ray
/// masks decide about visibility and only masked triangles pay for a filter function.
class EmbreeTracer final : public RayTracer {
public:
  /// Keeps a reference: the source must outlive the tracer.
  /// Throws Error(kInput) for positions or transforms that are not finite or indices out of range, MemoryError where
  /// the budget does not suffice, Error(kLimitExceeded) where the system runs out of memory, Error(kUnsupported) for an
  /// Embree built without the needed features, Error(kCancelled) after Progress::cancel().
  EmbreeTracer(const SceneSource& source, EmbreeConfig config);
  ~EmbreeTracer() override;
  EmbreeTracer(const EmbreeTracer&) = delete;
  EmbreeTracer& operator=(const EmbreeTracer&) = delete;

  std::string_view name() const override { return "embree"; }
  std::string_view isa() const override;
  const UnitSpace& space() const override { return space_; }

  void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                    std::span<RayHit> hits) const override;
  void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                std::span<uint8_t> occluded) const override;
  HitSurface resolve(const RayHit& hit) const override;

  /// "bvh": what Embree holds; "vertices" and "indices", which it reads; "tables".
  std::vector<ResidentPart> resident() const override;

  /// What Embree held while it committed each scene, and after: measured, so it may change a little from run to run.
  std::vector<TreeBytes> tree_bytes() const override { return tree_bytes_; }

  /// For Embree's own queries, with rays in space() and a ray class as their mask; benchmarks compare them.
  RTCSceneTy* handle() const;
  /// What such a query's result is, by Embree's numbers.
  /// @param geometry RTC_INVALID_GEOMETRY_ID where there is no hit
  /// @param instance RTC_INVALID_GEOMETRY_ID for hits outside Embree instances
  RayHit hit_of(float t, float u, float v, uint32_t instance, uint32_t geometry, uint32_t primitive) const;

private:
  struct Part;
  struct Device;
  struct Decoded;

  /// The vertices of a geometry in the coordinates that Embree sees.
  struct Surface {
    uint32_t geometry = 0;
    std::vector<Vec3> positions; ///< and two more entries: Embree reads 16 bytes at a time
    uint32_t first_part = 0;
    uint32_t part_count = 0;
  };
  /// What a geometry of the top scene stands for.
  struct Attachment {
    uint32_t placement = 0;
    uint32_t part = 0; ///< the first one of an Embree instance
  };

  void place(std::vector<Decoded>& decoded);
  uint32_t add_surface(uint32_t instance, const Decoded& decoded, const DAffine& surface_from_object);
  void split_parts(uint32_t surface, const std::vector<Triangle>& triangles, uint32_t instance);
  void attach();
  void commit(RTCSceneTy* scene, uint32_t geometry);
  void attach_surface(uint32_t placement, uint32_t surface);
  const Attachment& attachment_of(uint32_t instance, uint32_t geometry) const;
  void closest_packets(std::span<const Ray> rays, uint32_t ray_class, std::span<RayHit> hits) const;
  void closest_streams(std::span<const Ray> rays, uint32_t ray_class, std::span<RayHit> hits) const;

  const SceneSource& source_;
  EmbreeConfig config_;
  UnitSpace space_;
  MemoryReservation memory_; ///< of surfaces and parts
  std::vector<Surface> surfaces_;
  std::vector<Part> parts_;
  std::vector<Placement> placements_;
  std::vector<uint32_t> surface_of_placement_;
  std::vector<TreeBytes> tree_bytes_;
  std::vector<Attachment> attachments_; ///< by geometry id in the top scene
  std::unique_ptr<Device> device_;      ///< last: Embree lets go of the buffers above first
};

} // namespace packtrace
