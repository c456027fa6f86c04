#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "runtime/trace/source/scene_source.h"
#include "runtime/trace/unit_space.h"

namespace packtrace {

/// Ray classes, one bit of the ray mask each.
inline constexpr uint32_t kCameraRays = 1u << 0;    ///< hit what camera_visible() says
inline constexpr uint32_t kOcclusionRays = 1u << 1; ///< hit what occludes() says

/// In the tracer's space(). Directions need not be unit length; t counts them. Where tfar < tnear there is nothing to
/// hit: that is how a caller fills the gaps of a block of coherent rays.
struct Ray {
  Vec3 origin{0.0f};
  float tnear = 0.0f; ///< >= 0
  Vec3 direction{0.0f, 0.0f, 1.0f};
  float tfar = std::numeric_limits<float>::infinity();
};

inline constexpr uint32_t kNoHit = ~0u;

/// What a ray met first. The numbers are the tracer's own: RayTracer::resolve() says what they stand for.
struct RayHit {
  float t = std::numeric_limits<float>::infinity();
  float u = 0.0f, v = 0.0f; ///< weights of the triangle's second and third vertex
  uint32_t placement = kNoHit;
  uint32_t part = 0;
  uint32_t triangle = 0;

  bool valid() const { return placement != kNoHit; }
};

/// What callers know about the order of rays; results are the same for either.
enum class RayOrder : uint8_t {
  kCoherent,   ///< neighbours start and go nearly alike, 16 at a time: camera rays in blocks of 4 x 4 pixels
  kIncoherent, ///< directions differ; origins of neighbours lie near each other
};

/// A surface at its place.
struct Placement {
  uint32_t instance = 0;          ///< SceneSource::instances() index
  bool instanced = false;         ///< the tracer transforms rays into the surface's own coordinates
  DAffine unit_from_surface{1.0}; ///< from the surface's coordinates to space()
  glm::dmat3 surface_normal{1.0}; ///< the same for normals; results are not unit length
  glm::dmat3 object_normal{1.0};  ///< from object space to space() for normals; results are not unit length
  /// Instanced only: coordinates that arise in moving a unit-space point p into the surface are at most about
  /// moved_linear |p| + moved_offset per axis, the rounding of the inverse included (see ray_offset.h).
  glm::dmat3 moved_linear{0.0};
  DVec3 moved_offset{0.0};
};

/// What a hit stands for.
struct HitSurface {
  const Placement* placement = nullptr;
  uint32_t geometry = 0;
  uint32_t triangle = 0; ///< number in the geometry
  Vec3 vertices[3]{};    ///< in the surface's coordinates, as the tracer saw them
};

inline constexpr uint32_t kNoGeometry = ~0u;

/// Bytes that stay in memory for tracing, by what they hold.
struct ResidentPart {
  std::string_view name;
  uint64_t bytes = 0;
  bool shared = false; ///< with all other tracers of the same scene, which name the same bytes
};

/// Memory of one tree of a scene, or of all that lies in the world together.
struct TreeBytes {
  uint32_t geometry = kNoGeometry; ///< of the source; kNoGeometry: of the world
  uint64_t worst_case = 0;         ///< that building it takes, or may take
  uint64_t built = 0;
};

/// A scene made ready for ray queries: a tracing backend. All functions are const and may run on several threads.
class RayTracer {
public:
  virtual ~RayTracer() = default;

  virtual std::string_view name() const = 0;
  /// Instruction set of the kernels that run, such as avx2.
  virtual std::string_view isa() const { return "portable"; }
  virtual const UnitSpace& space() const = 0;

  /// About how many incoherent rays a call should have, where the caller has as many: fewer stay in nearer caches, more
  /// find company.
  virtual uint32_t rays_together() const { return 1024; }

  /// The nearest hit of each ray in (tnear, tfar). hits.size() == rays.size().
  /// @param ray_class one bit: which surfaces count, and which mask is looked up
  virtual void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                            std::span<RayHit> hits) const = 0;

  /// Whether each ray hits anything in (tnear, tfar): 1 or 0. occluded.size() == rays.size().
  virtual void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                        std::span<uint8_t> occluded) const = 0;

  /// @param hit valid, of this tracer
  virtual HitSurface resolve(const RayHit& hit) const = 0;

  /// All that tracing keeps in memory, geometry included where the tracer reads it.
  virtual std::vector<ResidentPart> resident() const = 0;

  /// Instances that no ray hits because their transform presses them onto a line or a point, or nearly so.
  virtual std::span<const uint32_t> flat_instances() const { return {}; }

  /// Of trees built here, as far as the backend knows.
  virtual std::vector<TreeBytes> tree_bytes() const { return {}; }
};

} // namespace packtrace
