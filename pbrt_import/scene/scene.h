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

namespace packtrace {

/// Triangles in the space of the shape that made them. Every index is in range, every position finite, no triangle
/// repeats an index; normals and uvs are empty or one per vertex.
/// The geometric normal is cross(p1 - p0, p2 - p0) in this space; it travels to other spaces with normal_matrix(), so
/// mirroring transforms do not turn it over (pbrt-v3, Triangle::Intersect).
struct Mesh {
  std::string name; ///< for people: file name or shape kind with its line
  std::vector<Vec3> positions;
  std::vector<Vec3> normals; ///< unit length, or empty: flat
  std::vector<Vec2> uvs;
  std::vector<Triangle> triangles;
};

inline constexpr uint32_t kNoMask = ~0u;
inline constexpr uint32_t kNoTexture = ~0u;

/// What ambient occlusion and simple shading need of a pbrt material together with its shape's alpha and light.
struct Material {
  std::string name;
  MaterialFlags flags = 0;
  Vec3 albedo{0.5f};                    ///< linear sRGB, [0,1]
  uint32_t alpha_mask = kNoMask;        ///< into Scene::masks, for all rays
  uint32_t shadow_alpha_mask = kNoMask; ///< into Scene::masks, for occlusion rays only
  uint32_t albedo_texture = kNoTexture; ///< into Scene::textures; albedo is its average
};

/// An invertible map and its parts: map = translation (its last column) * rotation * scale.
struct TransformKey {
  DAffine map{1.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0}; ///< unit length
  glm::dmat3 scale{1.0};                   ///< symmetric; positive definite, negative definite where the map mirrors
};

/// A transform that moves from one key to another.
struct AnimatedTransform {
  double start_time = 0.0; ///< pbrt's TransformTimes, in the unit of the shutter's times
  double end_time = 1.0;
  TransformKey start;
  TransformKey end; ///< its rotation lies in start's hemisphere: the way between them is the shorter one
};

/// The map at a time: translation and scale are blended linearly, rotation spherically. Exactly the start's map up to
/// start_time, exactly the end's from end_time on. Between keys of which one mirrors the map may be singular.
/// Source: Pharr, Jakob, Humphreys, Physically Based Rendering, 3rd ed. (2016), section 2.9.3.
DAffine interpolate(const AnimatedTransform& keys, double time);

inline constexpr uint32_t kNotAnimated = ~0u;

/// One pbrt Shape: a mesh placed in its parent's space (the world, or the object it belongs to).
struct Shape {
  Shape() = default;
  Shape(uint32_t mesh_number, uint32_t material_number, bool reversed, const DAffine& placement)
      : mesh(mesh_number), material(material_number), reverse_orientation(reversed), parent_from_mesh(placement) {}

  uint32_t mesh = 0;                 ///< into Scene::meshes; several shapes may share one
  uint32_t material = 0;             ///< into Scene::materials
  bool reverse_orientation = false;  ///< the geometric normal is the negated one
  uint32_t animation = kNotAnimated; ///< into Scene::animations; fills what would be padding
  DAffine parent_from_mesh{1.0};     ///< at Scene::time; may mirror; never singular
};

/// ObjectBegin ... ObjectEnd.
struct Object {
  std::string name;
  std::vector<Shape> shapes;
};

/// ObjectInstance.
struct Instance {
  uint32_t object = 0;            ///< into Scene::objects
  Affine world_from_object{1.0f}; ///< at Scene::time
};

/// That an instance moves: apart from Instance, of which there are many and which rarely do.
struct AnimatedInstance {
  uint32_t instance = 0;  ///< into Scene::instances
  uint32_t animation = 0; ///< into Scene::animations
};

enum class Projection : uint32_t { kPerspective = 0, kOrthographic = 1, kEnvironment = 2 };

/// A pbrt camera with its film. Camera space: +x right, +y up, +z forward (left-handed).
struct Camera {
  Projection projection = Projection::kPerspective;
  DAffine world_from_camera{1.0}; ///< at Scene::time; may scale or mirror: pbrt scenes do
  double fov_degrees = 90.0;      ///< perspective: full angle across the shorter image axis
  /// Film rectangle on the plane z = 1 in units of tan(fov/2) (perspective) or camera units (orthographic):
  /// x0, x1, y0, y1; x1 is the right edge, y1 the top edge.
  std::optional<glm::dvec4> screen_window; ///< none: [-a,a] x [-1,1] for aspect a >= 1, [-1,1] x [-1/a,1/a] below
  /// Pixels of the film. Of a film with a crop window: those inside, with the screen window around them.
  uint32_t width_px = 1280;
  uint32_t height_px = 720;
  std::string film_name;             ///< pbrt's output file name, for people
  double shutter_open = 0.0;         ///< in the unit of AnimatedTransform's times
  double shutter_close = 1.0;        ///< not before shutter_open
  uint32_t animation = kNotAnimated; ///< into Scene::animations
};

/// An imported scene: floats, no packing.
struct Scene {
  std::vector<Mesh> meshes;
  std::vector<Material> materials;
  std::vector<AlphaMask> masks;
  std::vector<AlbedoTexture> textures; ///< empty unless the import kept them
  std::vector<Shape> shapes;           ///< those outside objects, parent = world
  std::vector<Object> objects;
  std::vector<Instance> instances;
  std::vector<Camera> cameras; ///< empty where the file has none

  double time = 0.0;                                ///< when all transforms hold
  std::vector<AnimatedTransform> animations;        ///< empty where nothing moves
  std::vector<AnimatedInstance> animated_instances; ///< by ascending instance

  uint64_t dropped_triangles = 0; ///< degenerate, out-of-range or not finite; each is in the diagnostics
};

/// Memory that a mesh's vertices and triangles take.
uint64_t bytes_of(const Mesh& mesh);
/// Triangles stored once: each shape's mesh, objects counted once however often instanced.
uint64_t unique_triangle_count(const Scene& scene);
/// Triangles as placed: every instance counted.
uint64_t placed_triangle_count(const Scene& scene);
/// World box of everything placed, from instance boxes (so not always tight for rotated instances).
Bounds world_bounds(const Scene& scene);

} // namespace packtrace
