#pragma once

#include <span>
#include <vector>

#include "runtime/shade/environment.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// Radiance of the white sky that replaces the lights of a scene without any. With the default ambient light, an
/// open white surface is white.
inline constexpr float kDefaultSky = 0.6f;

/// A sample of the lights as seen from a point.
struct LightSample {
  Vec3 direction{0.0f};  ///< from the point to the light, unit length
  float distance = 0.0f; ///< world units; infinite for lights beyond the scene
  Vec3 radiance{0.0f};   ///< divided by the probability of the light; for points and directions: irradiance
  float density = 0.0f;  ///< over solid angle; 0: from a single direction, which random rays never hit
};

/// All lights of a scene, to be sampled: the scene's lights and the triangles of its area lights, at rest.
class LightSet {
public:
  /// A scene without any light gets a constant white sky of radiance kDefaultSky.
  /// @param source must outlive this object
  explicit LightSet(const SceneSource& source);

  /// Whether the scene has no lights and the white sky is used.
  bool uses_sky() const { return uses_sky_; }
  uint64_t triangle_count() const { return triangles_.size(); }
  size_t light_count() const { return lights_.size(); }

  /// Turns the scene's lights from where they are at rest about the vertical (estimate_world_view()) through the middle
  /// of the scene. Triangles that emit light stay.
  void turn(float degrees);

  /// Samples one light.
  /// @param normal unit length, of the shaded surface
  /// @param choice in [0, 1): chooses the light
  LightSample sample(Vec3 position, Vec3 normal, float choice, Vec2 point) const;

  /// Radiance of all infinite lights from a direction.
  Vec3 background(Vec3 direction) const;
  /// Density of sample() for the directions of infinite lights.
  float background_density(Vec3 direction, Vec3 normal) const;
  /// Density of sample() for a point on an area light.
  /// @param instance of the light
  /// @param cosine of the angle between its normal and the direction to it, not negative
  float emitter_density(uint32_t instance, Vec3 emission, float distance, float cosine) const;

private:
  struct EmittingTriangle {
    Vec3 corner, edge_u, edge_v;
    Vec3 normal; ///< of the side that emits, unit length
    uint32_t material;
  };
  /// The emitting triangles of an instance, which are sampled as one light.
  struct Emitter {
    size_t first, count; ///< in triangles_
    double emitted;      ///< sum of area times luminance
  };
  void add_emitters();
  void choose_probabilities();
  LightSample sample_emitter(const Emitter& emitter, Vec3 position, float choice, Vec2 point) const;
  LightSample sample_light(const Light& light, const Environment* map, Vec3 position, Vec3 normal, Vec2 point) const;
  Vec3 radiance_of(const Light& light, const Environment* map, Vec3 direction) const;
  static float density_of(const Light& light, const Environment* map, Vec3 direction, Vec3 normal);
  const Environment* map_of(const Light& light) const {
    return light.map == kNoMap ? nullptr : &environments_[light.map];
  }

  const SceneSource& source_;
  std::vector<Light> lights_;
  std::vector<Environment> environments_;
  std::vector<EmittingTriangle> triangles_;
  std::vector<float> triangle_steps_; ///< cumulative shares of each emitter's triangles
  std::vector<Emitter> emitters_;
  std::vector<uint32_t> emitter_of_; ///< by instance; empty without emitters
  std::vector<float> probability_;   ///< of each light, then of each emitter
  std::vector<float> steps_;         ///< cumulative
  bool uses_sky_ = false;
  float turned_degrees_ = 0.0f;
};

} // namespace packtrace
