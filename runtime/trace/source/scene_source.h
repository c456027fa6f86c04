#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "compress/format/textures/texture_codec.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// One placement of a geometry. Its index in SceneSource::instances() is the instance id of images.
struct PlacedGeometry {
  uint32_t geometry = 0;
  Affine world_from_object{1.0f};
};

struct GeometryCounts {
  uint32_t vertices = 0;
  uint32_t triangles = 0;
};

/// A point on a surface.
struct SurfaceQuery {
  uint32_t instance = 0;
  uint32_t triangle = 0; ///< number in the instance's geometry
  Vec2 barycentrics{0.0f};
};

/// The results of SceneSource::material_of() and shading_normal() at a point.
struct SurfaceAttributes {
  uint32_t material = 0;
  bool has_normal = false;
  Vec3 normal{0.0f};
};

/// What look_up() interpolates on a triangle.
struct TriangleAttributes {
  uint32_t material = 0;
  std::array<Vec3, 3> normals{Vec3(0), Vec3(0), Vec3(0)}; ///< of the corners, object space; 0 if the surface is flat
};

/// Interpolates texture coordinates.
/// @param barycentrics weights of the second and third corner
inline Vec2 interpolated_uv(const std::array<Vec2, 3>& corners, Vec2 barycentrics) {
  return corners[0] * (1.0f - barycentrics.x - barycentrics.y) + corners[1] * barycentrics.x +
         corners[2] * barycentrics.y;
}

/// Interpolates the normals of a triangle's corners in floats; the sum has no unit length and is 0 if they cancel.
/// @param u, v weights of the second and third corner
inline Vec3 interpolated_normal(Vec3 a, Vec3 b, Vec3 c, float u, float v) { return a * (1.0f - u - v) + b * u + c * v; }

/// Memory of environment maps' pixels.
inline uint64_t map_bytes(std::span<const EnvironmentMap> maps) {
  uint64_t bytes = 0;
  for (const EnvironmentMap& map : maps) bytes += map.radiance.size() * sizeof(Vec3);
  return bytes;
}

/// The level of detail of a triangle.
struct SurfaceDetail {
  uint32_t level = 0;   ///< LOD level; 0: the source geometry
  uint32_t cluster = 0; ///< number that identifies its cluster
  /// Bound of its distance from level 0, times the largest stretch of the instance; world units.
  float error_world = 0.0f;
};

/// A scene as tracing and shading need it, stored in a baked file (PackedSource) or in floats (FloatSource). Triangles
/// of a geometry are numbered in the order of decode(). All functions are const and may be called from several threads;
/// per-hit functions do not allocate. Both sources number instances alike: the scene's shapes outside objects in file
/// order, then its object instances.
class SceneSource {
public:
  virtual ~SceneSource() = default;

  virtual uint32_t geometry_count() const = 0;
  virtual GeometryCounts counts(uint32_t geometry) const = 0;

  /// Writes object-space vertices and triangles; the spans have exactly the sizes of counts().
  virtual void decode(uint32_t geometry, std::span<Vec3> positions, std::span<Triangle> triangles) const = 0;

  /// Index into materials(). Instances of one geometry may have different materials, but a triangle has the same
  /// baked::material_class() in all of them.
  /// @param triangle number in the instance's geometry
  virtual uint32_t material_of(uint32_t instance, uint32_t triangle) const = 0;

  /// Interpolated vertex normal in object space, unit length; none if the surface is flat.
  /// @param barycentrics weights of the triangle's second and third vertex
  virtual std::optional<Vec3> shading_normal(uint32_t geometry, uint32_t triangle, Vec2 barycentrics) const = 0;

  /// Evaluates material_of() and shading_normal() at many points; faster than single calls if neighbours lie close
  /// together.
  /// @param out as many elements as `places`
  virtual void look_up(std::span<const SurfaceQuery> places, std::span<SurfaceAttributes> out) const;

  /// Returns the attributes of the triangles of points, whose normals interpolated_normal() interpolates as look_up()
  /// does. Returns false, without result, if the source interpolates otherwise.
  /// @param out as many elements as `places`
  virtual bool look_up_triangles(std::span<const SurfaceQuery> /*places*/,
                                 std::span<TriangleAttributes> /*out*/) const {
    return false;
  }

  /// Texture coordinates of a triangle's vertices; (0,0) if the geometry has none.
  virtual std::array<Vec2, 3> corner_uvs(uint32_t geometry, uint32_t triangle) const = 0;

  /// Bound of |decoded - source| per axis in object units; 0 for floats. See docs/accuracy.md.
  virtual float position_error(uint32_t geometry) const = 0;

  /// @param triangle number in the instance's geometry
  virtual SurfaceDetail detail_of(uint32_t /*instance*/, uint32_t /*triangle*/) const { return {}; }

  virtual std::span<const PlacedGeometry> instances() const = 0;
  virtual std::span<const Material> materials() const = 0;
  virtual AlphaMaskView mask(uint32_t index) const = 0;
  /// The texture of an index in Material::albedo_texture.
  virtual TextureView texture(uint32_t) const { return {}; }
  /// Whether materials have their shading and there are lights; false: the file was not baked for shading.
  virtual bool has_shading() const { return false; }
  virtual std::span<const Light> lights() const { return {}; }
  /// Maps of an index in Light::map.
  virtual std::span<const EnvironmentMap> environment_maps() const { return {}; }
  /// False if no triangle of an instance emits light.
  virtual bool may_emit(uint32_t) const { return true; }
  virtual std::span<const Camera> cameras() const = 0;
  virtual Bounds world_bounds() const = 0;
  /// World coordinates of the zero that instances, cameras and bounds are relative to; see Scene::origin.
  virtual DVec3 origin() const = 0;

  /// Bytes of geometry that stay resident, without those that the tracing backend builds.
  virtual uint64_t resident_bytes() const = 0;
};

} // namespace packtrace
