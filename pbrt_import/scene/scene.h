#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include "pbrt_import/scene/albedo_texture.h"
#include "pbrt_import/scene/alpha_mask.h"
#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/material_flags.h"
#include "pbrt_import/scene/math.h"
#include "pbrt_import/scene/rigid_motion.h"
#include "pbrt_import/scene/shading.h"

namespace packtrace {

/// Step of a lattice through 0: mantissa 2^exponent.
struct LatticeStep {
  uint32_t mantissa = 0; ///< 8..15; 0: there is no lattice
  int32_t exponent = 0;
  bool operator==(const LatticeStep&) const = default;
};

/// A triangle mesh in the space of the shape that defines it. All indices are in range, all positions are finite, and
/// no triangle repeats an index; normals and uvs are empty or have one element per vertex.
/// The geometric normal is cross(p1 - p0, p2 - p0) in this space. normal_matrix() transforms it to other spaces, so
/// mirroring transforms do not flip it (pbrt-v3, Triangle::Intersect).
struct Mesh {
  std::string name; ///< file name, or kind of shape with its line; for display
  std::vector<Vec3> positions;
  std::vector<Vec3> normals; ///< of unit length; empty: flat shading
  std::vector<Vec2> uvs;
  std::vector<Triangle> triangles;
  /// Lattice that its file states for the positions: they are its points, rounded to floats. Not checked.
  LatticeStep lattice{};
};

inline constexpr uint32_t kNoMask = ~0u;
inline constexpr uint32_t kNoTexture = ~0u;

/// A pbrt material, together with its shape's alpha and area light, reduced to what ambient occlusion and simple
/// shading need.
struct Material {
  std::string name;
  MaterialFlags flags = 0;
  Vec3 albedo{0.5f};                    ///< linear sRGB, [0,1]
  uint32_t alpha_mask = kNoMask;        ///< index into Scene::masks, for all rays
  uint32_t shadow_alpha_mask = kNoMask; ///< index into Scene::masks, for occlusion rays only
  uint32_t albedo_texture = kNoTexture; ///< index into Scene::textures; albedo is the texture's average
  SurfaceShading shading{};             ///< the default unless Scene::has_shading
};

/// An invertible map and its decomposition: map = translation (its last column) * rotation * scale.
struct TransformKey {
  DAffine map{1.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0}; ///< unit length
  glm::dmat3 scale{1.0};                   ///< symmetric; positive definite, or negative definite if the map mirrors
};

/// A transform that moves between two keys.
struct AnimatedTransform {
  double start_time = 0.0; ///< from pbrt's TransformTimes, in the unit of shutter times
  double end_time = 1.0;
  TransformKey start;
  TransformKey end; ///< its rotation is in start's hemisphere, so that slerp takes the shorter way
};

/// Evaluates the map at a time: translation and scale are interpolated linearly, rotation spherically. Exactly the
/// start's map up to start_time, exactly the end's from end_time on. If only one key mirrors, the map may be singular
/// in between.
/// Source: Pharr, Jakob, Humphreys, Physically Based Rendering, 3rd ed. (2016), section 2.9.3.
DAffine interpolate(const AnimatedTransform& keys, double time);

inline constexpr uint32_t kNotAnimated = ~0u;

/// A pbrt Shape: a mesh placed in its parent's space (the world, or the object that contains it).
struct Shape {
  Shape() = default;
  Shape(uint32_t mesh_number, uint32_t material_number, bool reversed, const DAffine& placement)
      : mesh(mesh_number), material(material_number), reverse_orientation(reversed), parent_from_mesh(placement) {}

  uint32_t mesh = 0;                 ///< index into Scene::meshes; shapes may share a mesh
  uint32_t material = 0;             ///< index into Scene::materials
  bool reverse_orientation = false;  ///< whether the geometric normal is negated
  uint32_t animation = kNotAnimated; ///< index into Scene::animations; occupies padding
  DAffine parent_from_mesh{1.0};     ///< at Scene::time; may mirror, never singular
};

/// The shapes between ObjectBegin and ObjectEnd.
struct Object {
  std::string name;
  std::vector<Shape> shapes;
};

/// An ObjectInstance directive.
struct Instance {
  uint32_t object = 0;            ///< index into Scene::objects
  Affine world_from_object{1.0f}; ///< at Scene::time
};

/// Animation of an instance. Stored separately, because there are many instances and few of them move.
struct AnimatedInstance {
  uint32_t instance = 0;  ///< index into Scene::instances
  uint32_t animation = 0; ///< index into Scene::animations
};

enum class Projection : uint32_t { kPerspective = 0, kOrthographic = 1, kEnvironment = 2 };

/// A pbrt camera with its film. Camera space: +x right, +y up, +z forward (left-handed).
struct Camera {
  Projection projection = Projection::kPerspective;
  DAffine world_from_camera{1.0}; ///< at Scene::time; may scale or mirror, as in some pbrt scenes
  double fov_degrees = 90.0;      ///< perspective: full angle across the shorter image axis
  /// Film rectangle on the plane z = 1 in units of tan(fov/2) (perspective) or camera units (orthographic):
  /// x0, x1, y0, y1; x1 is the right edge, y1 the top edge.
  std::optional<glm::dvec4> screen_window; ///< unset: [-a,a] x [-1,1] for aspect a >= 1, [-1,1] x [-1/a,1/a] below
  /// Size of the film in pixels. With a crop window, only its pixels count and screen_window is reduced to it.
  uint32_t width_px = 1280;
  uint32_t height_px = 720;
  std::string film_name;             ///< pbrt's output file name, for display
  double shutter_open = 0.0;         ///< in the unit of AnimatedTransform::start_time
  double shutter_close = 1.0;        ///< at least shutter_open
  uint32_t animation = kNotAnimated; ///< index into Scene::animations
};

/// An imported scene in floating point, not yet packed.
struct Scene {
  std::vector<Mesh> meshes;
  std::vector<Material> materials;
  std::vector<AlphaMask> masks;
  std::vector<AlbedoTexture> textures; ///< empty unless ImportOptions::keep_textures
  std::vector<Shape> shapes;           ///< shapes outside objects; their parent is the world
  std::vector<Object> objects;
  std::vector<Instance> instances;
  std::vector<Camera> cameras; ///< empty if the file has none
  bool has_shading = false;    ///< Material::shading and the lights are those of the file (ImportOptions::keep_shading)
  std::vector<Light> lights;
  std::vector<EnvironmentMap> environment_maps;

  /// World coordinates of this scene's zero, not 0 if the world was moved (move_far_world()): transforms and cameras
  /// map to world coordinates minus the origin.
  DVec3 origin{0.0};
  double time = 0.0;                                ///< time at which all transforms are evaluated
  std::vector<AnimatedTransform> animations;        ///< empty if nothing moves
  std::vector<AnimatedInstance> animated_instances; ///< sorted by instance
  RigidMotion motion; ///< of glTF files; otherwise separate_motion() makes it of the animations

  uint64_t dropped_triangles = 0; ///< repeated or out-of-range index, or non-finite vertex; see the diagnostics
};

/// Bytes of a mesh's vertices and triangles.
uint64_t bytes_of(const Mesh& mesh);
/// Number of stored triangles: the meshes of all shapes, with objects counted once regardless of their instances.
uint64_t unique_triangle_count(const Scene& scene);
/// Number of triangles with all instances counted.
uint64_t placed_triangle_count(const Scene& scene);
/// World-space bounds of all shapes and instances at all times, computed from transformed boxes; not always tight for
/// rotated ones.
Bounds world_bounds(const Scene& scene);

} // namespace packtrace
