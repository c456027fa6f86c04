#pragma once

#include <memory>

#include "runtime/camera/primary_visibility.h"
#include "runtime/shade/hit_surfaces.h"
#include "runtime/shade/path_tracer.h"
#include "runtime/trace/embree/embree_tracer.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace::test {

/// Adds a world shape of a material.
inline uint32_t add_shaded(Scene& scene, Mesh mesh, const SurfaceShading& shading, Vec3 albedo = Vec3(0.5f),
                           MaterialFlags flags = 0) {
  scene.has_shading = true;
  if (shading.transmits()) flags |= kTransmissive;
  if (shading.emits()) flags |= kEmissive;
  const uint32_t shape = add_shape(scene, std::move(mesh), flags);
  Material& material = scene.materials[scene.shapes[shape].material];
  material.shading = shading, material.albedo = albedo;
  return shape;
}

inline Light sky_of(Vec3 radiance) {
  Light light;
  light.kind = LightKind::kInfinite, light.radiance = radiance;
  return light;
}

/// A surface without diffuse reflection.
inline SurfaceShading specular_surface(ShadingBits bits, float roughness = 0.0f) {
  SurfaceShading s;
  s.bits = bits, s.diffuse = 0.0f, s.specular = Vec3(1.0f), s.roughness = roughness;
  return s;
}

inline SurfaceShading emitter(Vec3 radiance) {
  SurfaceShading s;
  s.emission = radiance, s.diffuse = 0.0f;
  return s;
}

/// A scene ready to be shaded. The scene must outlive it.
struct ShadeBench {
  explicit ShadeBench(const Scene& scene) : source(scene), tracer(source, {}), shade_scene(source) {}

  /// The mean of some frames.
  /// @param width_px TextureFilter::width_px; 0: textures are looked up at points
  ShadedFrame shade(const Camera& camera, ImageSize size, const ShadeConfig& config, uint32_t frames,
                    float width_px = 1.0f) {
    const PrimaryCamera primary(camera, size);
    Progress progress;
    trace_primary(source, tracer, primary, {primary}, gbuffer, progress, {&shade_scene.textures(), width_px});
    ShadedFrame sum, frame;
    ShadeSamples samples;
    samples.ambient_radius = 1.0f;
    samples.width_px = width_px;
    for (uint32_t i = 0; i < frames; ++i) {
      samples.frame = i;
      trace_shading(source, tracer, shade_scene, primary, gbuffer, config, samples, frame, progress);
      if (i == 0)
        sum = frame;
      else
        for (size_t p = 0; p < size.pixels(); ++p)
          sum.direct[p] += frame.direct[p], sum.specular[p] += frame.specular[p], sum.ambient[p] += frame.ambient[p];
    }
    for (size_t p = 0; p < size.pixels(); ++p)
      for (std::vector<Vec3>* layer : {&sum.direct, &sum.specular, &sum.ambient})
        (*layer)[p] /= static_cast<float>(frames);
    return sum;
  }

  FloatSource source;
  EmbreeTracer tracer;
  ShadeScene shade_scene;
  GBuffer gbuffer;
};

/// Radiance of the middle of a picture: its 4 x 4 pixels' mean, direct and specular.
inline Vec3 middle(const Scene& scene, const Camera& camera, const ShadeConfig& config = {}, uint32_t frames = 16) {
  ShadeBench bench(scene);
  const ShadedFrame frame = bench.shade(camera, {4, 4}, config, frames);
  Vec3 sum(0.0f);
  for (size_t p = 0; p < 16; ++p) sum += frame.direct[p] + frame.specular[p];
  return sum / 16.0f;
}

/// A floor around the origin that faces +y, and a camera that sees only its middle from an angle to the normal.
inline Mesh floor_quad(float half = 10.0f) {
  return quad(Vec3(-half, 0, -half), Vec3(0, 0, 2 * half), Vec3(2 * half, 0, 0));
}
inline Camera floor_camera(double degrees = 30.0) {
  const double a = degrees * 3.14159265358979 / 180.0;
  return camera_at(0.5 * DVec3(0, std::cos(a), -std::sin(a)), DVec3(0, 0, 0), 0.5); // below the lights of tests
}

} // namespace packtrace::test
