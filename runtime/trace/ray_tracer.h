#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "runtime/trace/source/scene_source.h"
#include "runtime/trace/unit_space.h"

namespace packtrace {

/// Ray classes, one bit of the ray mask each.
inline constexpr uint32_t kCameraRays = 1u << 0;    ///< hit surfaces that are camera_visible()
inline constexpr uint32_t kOcclusionRays = 1u << 1; ///< hit surfaces that occlude (occludes())

/// A ray in the tracer's space(). The direction need not have unit length; t is in multiples of it. A ray with tfar <
/// tnear hits nothing; callers use such rays to fill the gaps of a block of coherent rays.
struct Ray {
  Vec3 origin{0.0f};
  float tnear = 0.0f; ///< >= 0
  Vec3 direction{0.0f, 0.0f, 1.0f};
  float tfar = std::numeric_limits<float>::infinity();
};

inline constexpr uint32_t kNoHit = ~0u;

/// The nearest hit of a ray. The numbers are internal to the tracer; RayTracer::resolve() translates them.
struct RayHit {
  float t = std::numeric_limits<float>::infinity();
  float u = 0.0f, v = 0.0f; ///< weights of the triangle's second and third vertex
  uint32_t placement = kNoHit;
  uint32_t part = 0;
  uint32_t triangle = 0;

  bool valid() const { return placement != kNoHit; }
};

/// The order of rays as a hint; results do not depend on it.
enum class RayOrder : uint8_t {
  kCoherent,   ///< neighbours have similar origins and directions, 16 at a time: camera rays in blocks of 4 x 4 pixels
  kIncoherent, ///< directions differ; neighbours have similar origins
};

/// A placed surface.
struct Placement {
  uint32_t instance = 0;          ///< index into SceneSource::instances()
  bool instanced = false;         ///< the tracer transforms rays into the surface's own coordinates
  DAffine unit_from_surface{1.0}; ///< from the surface's coordinates to space()
  glm::dmat3 surface_normal{1.0}; ///< the same for normals; results do not have unit length
  glm::dmat3 object_normal{1.0};  ///< from object space to space() for normals; results do not have unit length
  /// Instanced only: bounds of the coordinates that arise when a unit-space point p is transformed into the surface's
  /// space, about moved_linear |p| + moved_offset per axis, including the rounding of the inverse (see ray_offset.h).
  glm::dmat3 moved_linear{0.0};
  DVec3 moved_offset{0.0};
};

/// The surface that was hit.
struct HitSurface {
  const Placement* placement = nullptr;
  uint32_t geometry = 0;
  uint32_t triangle = 0; ///< number in the geometry of the source
  Vec3 vertices[3]{};    ///< in the surface's coordinates, as traced
};

inline constexpr uint32_t kNoGeometry = ~0u;

/// Memory that stays allocated for tracing, by purpose.
struct ResidentPart {
  std::string_view name;
  uint64_t bytes = 0;
  bool shared = false; ///< shared with all other tracers of the same scene, which report the same bytes
};

/// Memory of one tree of a scene.
struct TreeBytes {
  uint32_t geometry = kNoGeometry; ///< geometry of the source; kNoGeometry for the tree of the world
  uint64_t worst_case = 0;         ///< bytes while it is built: measured peak or upper bound
  uint64_t built = 0;
};

/// A scene prepared for ray queries: a tracing backend. All functions but place_instances() are const and may run on
/// several threads.
class RayTracer {
public:
  virtual ~RayTracer() = default;

  virtual std::string_view name() const = 0;
  /// Instruction set of the kernels in use, such as avx2.
  virtual std::string_view isa() const { return "portable"; }
  virtual const UnitSpace& space() const = 0;

  /// Preferred number of incoherent rays per call, if the caller has as many. Fewer rays stay in nearer caches; more
  /// rays form larger groups.
  virtual uint32_t preferred_rays_per_call() const { return 1024; }

  /// Finds the nearest hit of each ray in (tnear, tfar). hits.size() == rays.size().
  /// @param ray_class one bit: selects the surfaces and the alpha mask that count
  virtual void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                            std::span<RayHit> hits) const = 0;

  /// Writes for each ray whether it hits anything in (tnear, tfar): 1 or 0. occluded.size() == rays.size().
  virtual void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                        std::span<uint8_t> occluded) const = 0;

  /// Returns the surface that was hit.
  /// @param hit a valid hit of this tracer
  virtual HitSurface resolve(const RayHit& hit) const = 0;

  /// Moves instances; the others stay where they are. The results of queries are then those of a tracer that is made
  /// with these transforms, the same movers and the same space(). No query may run at the same time.
  /// @param instances numbers of some of the tracer's movers (Movers::instances), strictly ascending
  /// @param world_from_object by element of `instances`; a transform may be flat
  /// Throws Error(kUsage) for instances that may not move or that leave Movers::world by more than half its size,
  /// Error(kInput) for transforms that are not finite; then nothing has moved.
  virtual void place_instances(std::span<const uint32_t> instances, std::span<const Affine> world_from_object);

  /// The transforms of all instances as they are placed; empty if none may move: they are those of the source then.
  virtual std::span<const Affine> world_from_object() const { return {}; }

  /// Returns the object-space vertices of a triangle that was hit. Only for tracers with movers.
  /// @param surface resolve(hit)
  virtual std::array<DVec3, 3> object_vertices(const RayHit& hit, const HitSurface& surface) const;

  /// All memory that tracing keeps, including geometry if the tracer reads it.
  virtual std::vector<ResidentPart> resident() const = 0;

  /// Instances that cannot be hit because their transform maps them onto a line or a point, or nearly so.
  virtual std::span<const uint32_t> flat_instances() const { return {}; }

  /// Memory of the trees that the tracer built, as far as the backend reports it.
  virtual std::vector<TreeBytes> tree_bytes() const { return {}; }
};

} // namespace packtrace
