#pragma once

#include <memory>
#include <span>
#include <vector>

#include "runtime/trace/scene_source.h"
#include "runtime/trace/unit_space.h"

struct RTCSceneTy;

namespace packtrace {

/// Ray classes, one bit of the ray mask each.
inline constexpr uint32_t kCameraRays = 1u << 0;    ///< hit what camera_visible() says
inline constexpr uint32_t kOcclusionRays = 1u << 1; ///< hit what occludes() says

enum class BvhQuality : uint8_t {
  kMedium, ///< deterministic
  kHigh,   ///< spatial splits: slower to build, faster to trace; the tree may differ from build to build
};

struct EmbreeConfig {
  BvhQuality quality = BvhQuality::kMedium;
  /// Watertight: no ray passes between two triangles that share an edge. Without, about one camera ray in 40,000 does
  /// on finely tessellated surfaces and leaves a dot; tracing is up to a fifth faster then, and kHigh splits in space.
  bool robust = true;
};

/// Sets flush-to-zero and denormals-are-zero for its lifetime on its thread, as Embree wants around ray queries.
class FlushDenormals {
public:
  FlushDenormals();
  ~FlushDenormals();
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

private:
  unsigned int saved_;
};

/// Everything needed to trace one SceneSource with Embree 3: float triangles decoded once, and the trees over them.
///
/// Rays live in a unit space (space()), a power-of-two scale and a translation away from the world, so that scenes of
/// any scale between 1e-30 and 1e30 work. Geometries that are placed once and untransformed share it; all others have
/// a unit space of their own and are Embree instances. Placements that float arithmetic cannot invert (flattening, or
/// vastly smaller than the scene) are traced as moved copies instead.
/// Per geometry there is one RTCGeometry for each combination of camera_visible, occludes and needs_mask, so ray
/// masks decide about visibility and only masked triangles pay for a filter function.
class EmbreeScene {
public:
  /// Keeps a reference: the source must outlive the scene.
  /// Throws Error(kInput) for positions or transforms that are not finite or indices out of range,
  /// Error(kLimitExceeded) if memory runs out, Error(kUnsupported) for an Embree built without the needed features,
  /// Error(kCancelled) after Progress::cancel().
  EmbreeScene(const SceneSource& source, EmbreeConfig config);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  const UnitSpace& space() const { return space_; }

  /// For Embree's ray queries, with rays in space() and one of the ray class bits as ray mask. Thread-safe.
  RTCSceneTy* handle() const;

  /// The vertices of a geometry in the coordinates that Embree sees.
  struct Surface {
    uint32_t geometry = 0;
    std::vector<Vec3> positions; ///< and two more entries: Embree reads 16 bytes at a time
    uint32_t first_part = 0;
    uint32_t part_count = 0;
  };

  /// A surface at its place.
  struct Placement {
    uint32_t instance = 0; ///< SceneSource::instances() index
    uint32_t surface = 0;
    bool instanced = false;         ///< Embree transforms rays into the surface's own coordinates
    DAffine unit_from_surface{1.0}; ///< from the surface's coordinates to space()
    glm::dmat3 surface_normal{1.0}; ///< the same for normals; results are not unit length
    glm::dmat3 object_normal{1.0};  ///< from object space to space() for normals; results are not unit length
    /// Instanced only: coordinates that arise in moving a unit-space point p into the surface are at most about
    /// moved_linear |p| + moved_offset per axis, the rounding of the inverse included (see ray_offset.h).
    glm::dmat3 moved_linear{0.0};
    DVec3 moved_offset{0.0};
  };

  /// What a ray hit.
  struct Hit {
    const Placement* placement = nullptr;
    uint32_t geometry = 0;
    uint32_t triangle = 0;     ///< number in the geometry
    const Vec3* vertices[3]{}; ///< in the surface's coordinates
  };

  /// Looks up Embree's hit ids. @param instance RTC_INVALID_GEOMETRY_ID for hits outside Embree instances
  Hit resolve(uint32_t instance, uint32_t geometry, uint32_t primitive) const;

  /// Bytes that Embree holds.
  uint64_t bvh_bytes() const;
  /// All of it: Embree's bytes, decoded positions and triangles, tables.
  uint64_t resident_bytes() const;

private:
  struct Part;
  struct Device;
  struct Decoded;
  struct Attachment {
    uint32_t placement = 0;
    uint32_t part = 0; ///< the first one of an Embree instance
  };

  void place(std::vector<Decoded>& decoded);
  uint32_t add_surface(uint32_t instance, const Decoded& decoded, const DAffine& surface_from_object);
  void split_parts(Surface& surface, const std::vector<Triangle>& triangles, uint32_t instance);
  const Attachment& attachment_of(uint32_t instance, uint32_t geometry) const;
  void attach();

  const SceneSource& source_;
  EmbreeConfig config_;
  UnitSpace space_;
  std::vector<Surface> surfaces_;
  std::vector<Part> parts_;
  std::vector<Placement> placements_;
  std::vector<Attachment> attachments_; ///< by geometry id in the top scene
  std::unique_ptr<Device> device_;      ///< last: Embree lets go of the buffers above first
};

} // namespace packtrace
