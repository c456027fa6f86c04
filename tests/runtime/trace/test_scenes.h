#pragma once

#include <cstdint>
#include <vector>

#include "pbrt_import/scene/scene.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/trace/embree/embree_tracer.h"

namespace packtrace::test {

/// A parallelogram a, a+u, a+u+v, a+v with texture coordinates over [0,1]^2.
Mesh quad(Vec3 a, Vec3 u, Vec3 v);

/// Axis-aligned box whose triangles face outwards.
Mesh box(Vec3 lo, Vec3 hi);

/// Latitude-longitude sphere of rings x 2 rings cells with smooth vertex normals. Its triangles lie inside the exact
/// sphere.
Mesh sphere(Vec3 centre, float radius, uint32_t rings);

/// Returns a transform that scales, then rotates, then translates: pbrt's order.
DAffine placed(DVec3 translation, DVec3 scale = DVec3(1.0), double turn_degrees = 0.0, DVec3 axis = DVec3(0, 1, 0));

/// Adds a mesh as a world shape and returns its index in Scene::shapes.
uint32_t add_shape(Scene& scene, Mesh mesh, MaterialFlags flags = 0, const DAffine& world_from_mesh = DAffine(1.0));

/// Adds a mesh as an object of one shape and returns its index in Scene::objects.
uint32_t add_object(Scene& scene, Mesh mesh, MaterialFlags flags = 0);

/// A G-buffer of 8 x 8 pixels that all show the same point.
GBuffer point_gbuffer(Vec3 position, Vec3 normal, float offset);

/// Mean AO at a point over 64 pixels of config.spp samples each.
double ao_at(const Scene& scene, Vec3 position, Vec3 normal, const AoConfig& config, float offset = 1e-5f);

/// A perspective camera as in Scene::cameras.
Camera camera_at(DVec3 eye, DVec3 target, double fov_degrees = 60.0);

/// Primary rays and AO of a whole image.
struct Rendered {
  GBuffer gbuffer;
  AoFrame ao;
};
Rendered render(const Scene& scene, const Camera& camera, ImageSize size, const AoConfig& config,
                EmbreeConfig embree = {});

} // namespace packtrace::test
