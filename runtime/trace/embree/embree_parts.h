#pragma once

#include <array>
#include <utility>
#include <vector>

#include "runtime/trace/embree/embree_device.h"
#include "runtime/trace/embree/embree_tracer.h"

/// The private types of EmbreeTracer.
namespace packtrace {

inline constexpr size_t kPaddingVertices = 2; ///< after the vertices of a surface

// A class is a combination of camera_visible, occludes, needs_mask and is_sliver(); the first two bits are also the
// Embree geometry mask.
inline constexpr uint32_t kMaskedClass = 1u << 2;
inline constexpr uint32_t kSliverClass = 1u << 3;
inline constexpr uint32_t kClassCount = 16;

/// The triangles of one surface that have the same class; the user data of one RTCGeometry.
struct EmbreeTracer::Part {
  const EmbreeTracer* tracer = nullptr;
  uint32_t surface = 0;
  uint32_t material_class = 0;
  std::vector<Triangle> triangles;
  std::vector<uint32_t> source_triangles; ///< by triangle: its number in the geometry; empty if that is the same

  uint32_t source_triangle(uint32_t i) const { return source_triangles.empty() ? i : source_triangles[i]; }

  /// Whether a ray hits the plane of a triangle in double precision where its interval begins or later. Occlusion rays
  /// must hit the triangle itself, too: rounding must not let a ray hit the face beyond the edge that it starts beside.
  /// For camera rays Embree decides, so that none slips between a sliver and its neighbours.
  bool is_hit_ahead(const RTCFilterFunctionNArguments* args, uint32_t i) const;

  /// Embree filter function: rejects hits where an alpha mask removes the surface, and hits of slivers that
  /// is_hit_ahead() rejects.
  static void filter(const RTCFilterFunctionNArguments* args);
};

/// The Embree objects. The order matters: members are destroyed in reverse.
struct EmbreeTracer::Device {
  explicit Device(const EmbreeConfig& config) : embree(config.memory, config.device) {}

  EmbreeDevice embree;
  std::vector<RtcPtr<RTCSceneTy>> surface_scenes; ///< by surface; null unless the surface is instanced
  RtcPtr<RTCSceneTy> top;

  RtcPtr<RTCSceneTy> new_scene(const EmbreeConfig& config);
  // The functions below return the geometry's id in the scene.
  uint32_t attach(RTCScene scene, RtcPtr<RTCGeometryTy> geometry);
  uint32_t attach_part(RTCScene scene, Part& part, const Surface& surface);
  uint32_t attach_instance(RTCScene instanced, const Affine& unit_from_surface, uint32_t ray_mask);
};

/// A geometry as decoded by the source.
struct EmbreeTracer::Decoded {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  Bounds bounds;
  uint32_t uses = 0;

  /// Fills and checks positions, triangles and bounds. Throws Error(kInput) for positions that are not finite or
  /// indices out of range.
  void read(const SceneSource& source, uint32_t geometry);
};

} // namespace packtrace
