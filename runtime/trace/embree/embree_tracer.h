#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "pbrt_import/base/memory_budget.h"
#include "runtime/trace/movers.h"
#include "runtime/trace/ray_tracer.h"

struct RTCSceneTy;

namespace packtrace {

enum class BvhQuality : uint8_t {
  kMedium, ///< deterministic
  kHigh,   ///< spatial splits: slower to build, faster to trace; the tree may differ from build to build
};

struct EmbreeConfig {
  BvhQuality quality = BvhQuality::kMedium;
  /// Watertight: no ray passes between two triangles that share an edge. Without this flag about one camera ray in
  /// 40,000 does on finely tessellated surfaces and leaves a dot. Tracing is then up to a fifth faster, and kHigh uses
  /// spatial splits.
  bool robust = true;
  bool compact = false; ///< smaller and slower trees
  /// Tests hits of thin triangles again in double precision. Embree alone lets rays hit the sliver that they start on.
  bool check_slivers = true;
  /// Reserves memory for vertices, indices and trees; unset: no limit.
  std::optional<MemoryBudget> memory = std::nullopt;
  /// Configuration of rtcNewDevice(), such as "max_isa=avx2"; null: Embree's defaults.
  const char* device = nullptr;
};

/// Traces a SceneSource with Embree 3: triangles are decoded to floats once, and Embree builds its trees over them.
///
/// Coherent closest-hit rays are traced as packets of 16 with Embree's coherent flag, all others as streams with the
/// incoherent flag. On each kind of ray the other flag costs a factor of two to four (docs/tracing.md).
///
/// Rays are given in a unit space (space()), which differs from world space by a power-of-two scale and a translation,
/// so scenes of any scale between 1e-30 and 1e30 work. Geometries that are placed once and untransformed lie in this
/// space. All others have their own unit space and become Embree instances. Placements that float arithmetic
/// cannot invert (flattening, or vastly smaller than the scene) are traced as transformed copies instead. Movers are
/// always Embree instances; while they are flat, they have a thickness (traceable_placement()).
/// Each geometry has one RTCGeometry per combination of camera_visible, occludes and needs_mask: ray masks decide about
/// visibility, and only masked triangles need a filter function.
class EmbreeTracer final : public RayTracer {
public:
  /// Keeps a reference: the source must outlive the tracer.
  /// Throws Error(kInput) for positions or transforms that are not finite or indices out of range, MemoryError where
  /// the budget does not suffice, Error(kLimitExceeded) where the system runs out of memory, Error(kUnsupported) for an
  /// Embree built without the needed features, Error(kCancelled) after Progress::cancel(), Error(kUsage) for movers
  /// that do not exist.
  EmbreeTracer(const SceneSource& source, EmbreeConfig config, const Movers& movers = {});
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

  void place_instances(std::span<const uint32_t> instances, std::span<const Affine> world_from_object) override;
  std::span<const Affine> world_from_object() const override { return world_from_object_; }
  std::array<DVec3, 3> object_vertices(const RayHit& hit, const HitSurface& surface) const override;

  std::span<const uint32_t> flat_instances() const override { return flat_instances_; }

  /// "bvh" (memory of Embree's trees), "vertices" and "indices" (buffers that Embree reads), and "tables".
  std::vector<ResidentPart> resident() const override;

  /// Peak and final memory of Embree for each scene that it built. These are measured, so they may vary a little from
  /// run to run.
  std::vector<TreeBytes> tree_bytes() const override { return tree_bytes_; }

  /// Embree's top scene, for queries with Embree's API: rays are in space() and have a ray class as their mask.
  /// Benchmarks use it.
  RTCSceneTy* handle() const;
  /// Converts the result of such a query to a RayHit.
  /// @param geometry RTC_INVALID_GEOMETRY_ID if there is no hit
  /// @param instance RTC_INVALID_GEOMETRY_ID for hits outside Embree instances
  RayHit hit_of(float t, float u, float v, uint32_t instance, uint32_t geometry, uint32_t primitive) const;

private:
  struct Part;
  struct Device;
  struct Decoded;

  /// The vertices of a geometry in the coordinates in which Embree traces it.
  struct Surface {
    uint32_t geometry = 0;
    std::vector<Vec3> positions; ///< plus two padding entries: Embree reads 16 bytes at a time
    uint32_t first_part = 0;
    uint32_t part_count = 0;
    UnitSpace own; ///< its space, if it is instanced
    Bounds bounds; ///< in that space
  };
  /// The placement and part of a geometry of the top scene.
  struct Attachment {
    uint32_t placement = 0;
    uint32_t part = 0; ///< for an Embree instance: its first part
  };

  void place(std::vector<Decoded>& decoded, const Movers& movers);
  DAffine unit_from_own(const UnitSpace& own, const Affine& world_from_object) const;
  void update_mover(uint32_t instance, const DAffine& world_from_object);
  void list_flat_instances();
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
  // Of movers; empty without.
  std::vector<uint8_t> movable_;          ///< by instance
  std::vector<Affine> world_from_object_; ///< by instance
  std::vector<uint32_t> placement_of_;    ///< by instance; kNoHit without triangles
  std::vector<uint32_t> attachment_of_;   ///< by placement: geometry id in the top scene
  std::vector<uint8_t> hidden_;           ///< by placement: 1 if the mover is flat
  std::vector<uint32_t> flat_instances_;
  std::vector<Attachment> attachments_; ///< by geometry id in the top scene
  std::unique_ptr<Device> device_;      ///< declared last: destroyed before the buffers above
};

} // namespace packtrace
