#include "runtime/measure/stability.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "compress/bake/bake_scene.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/far_world.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/embree/embree_tracer.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "runtime/trace/source/float_source.h"
#include "runtime/trace/source/packed_source.h"

namespace packtrace {
namespace {

using Extended = long double;
constexpr ImageSize kSize{96, 64};
constexpr uint32_t kSpp = 16;

struct ExtendedVec {
  Extended x, y, z;
};

ExtendedVec difference(DVec3 a, DVec3 b) {
  return {static_cast<Extended>(a.x) - b.x, static_cast<Extended>(a.y) - b.y, static_cast<Extended>(a.z) - b.z};
}

ExtendedVec sum(const ExtendedVec& a, const ExtendedVec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

Extended dot(const ExtendedVec& a, const ExtendedVec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

ExtendedVec cross(const ExtendedVec& a, const ExtendedVec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// The packed file and the source floats, traced with the same rays.
struct Traced {
  GBuffer surfaces;
  AoFrame ao;
};

Traced trace(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& camera, const AoConfig& ao) {
  Traced result;
  Progress progress;
  trace_primary(source, tracer, camera, camera, result.surfaces, progress);
  trace_ao(source, tracer, result.surfaces, ao, 0, result.ao, progress);
  return result;
}

AoConfig ao_of(const StabilityCase& stability_case) {
  AoConfig ao;
  ao.radius = static_cast<float>(stability_case.ao_radius);
  ao.spp = kSpp;
  ao.falloff = stability_case.shape == StabilityShape::kAny; // otherwise occlusion counts rays
  return ao;
}

void count_pixels(const PrimaryCamera& camera, std::span<const WorldTriangle> triangles, const GBuffer& surfaces,
                  StabilityResult& result) {
  for (uint32_t y = 0; y < kSize.height; ++y)
    for (uint32_t x = 0; x < kSize.width; ++x) {
      const size_t pixel = size_t{y} * kSize.width + x;
      const CameraRay ray = camera.ray(x, y);
      const double distance = exact_distance(ray, triangles);
      const bool hit = std::isfinite(distance), shown = surfaces.instance[pixel] != kNoInstance;
      result.hits += hit;
      result.wrong_pixels += hit != shown;
      if (!hit || !shown) continue;
      const double z = camera.view_z(ray.origin + ray.direction * distance);
      result.wrong_depths += !(std::abs(double{surfaces.view_z[pixel]} - z) <= 1e-3 * z);
    }
}

void count_occlusion(StabilityShape shape, const Traced& packed, const Traced& floats, StabilityResult& result) {
  double sum = 0.0;
  uint32_t both = 0;
  for (size_t i = 0; i < packed.ao.ao.size(); ++i) {
    if (packed.surfaces.instance[i] == kNoInstance) continue;
    const double open = double{packed.ao.ao[i]} * kSpp;
    if (shape == StabilityShape::kConvex) result.self_intersections += static_cast<uint32_t>(std::lround(kSpp - open));
    if (shape == StabilityShape::kClosed) result.leaks += static_cast<uint32_t>(std::lround(open));
    if (floats.surfaces.instance[i] == kNoInstance && shape == StabilityShape::kAny) continue;
    const double truth = shape == StabilityShape::kConvex   ? 1.0
                         : shape == StabilityShape::kClosed ? 0.0
                                                            : double{floats.ao.ao[i]};
    sum += std::abs(double{packed.ao.ao[i]} - truth);
    ++both;
  }
  result.ao_mae = both > 0 ? sum / both : 0.0;
}

} // namespace

std::vector<WorldTriangle> world_triangles(const Scene& scene) {
  std::vector<WorldTriangle> result;
  for (const Shape& shape : scene.shapes) {
    const Mesh& mesh = scene.meshes[shape.mesh];
    const auto corner = [&](uint32_t v) { return transform_point(shape.parent_from_mesh, DVec3(mesh.positions[v])); };
    for (const Triangle& t : mesh.triangles) result.push_back({corner(t.x), corner(t.y), corner(t.z)});
  }
  return result;
}

double exact_distance(const CameraRay& ray, std::span<const WorldTriangle> triangles) {
  const ExtendedVec d = difference(ray.direction, DVec3(0.0));
  Extended nearest = std::numeric_limits<Extended>::infinity();
  for (const WorldTriangle& triangle : triangles) {
    // Edge functions do not change if the origin moves along the ray; near the triangle they lose nothing to rounding.
    const ExtendedVec far = difference(triangle.a, ray.origin);
    const Extended near = dot(far, d) / dot(d, d);
    const ExtendedVec a = {far.x - near * d.x, far.y - near * d.y, far.z - near * d.z};
    const ExtendedVec b = sum(a, difference(triangle.b, triangle.a)), c = sum(a, difference(triangle.c, triangle.a));
    const Extended u = dot(d, cross(b, c)), v = dot(d, cross(c, a)), w = dot(d, cross(a, b));
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) continue;
    const Extended volume = u + v + w;
    if (volume == 0) continue; // parallel, or without area
    const Extended t = near + dot(a, cross(b, c)) / volume;
    if (t > 0) nearest = std::min(nearest, t);
  }
  return static_cast<double>(nearest);
}

nlohmann::json to_json(const StabilityResult& r) {
  return {{"name", r.name},
          {"triangles", r.triangles},
          {"pixels", r.pixels},
          {"hits", r.hits},
          {"wrong_pixels", r.wrong_pixels},
          {"wrong_depths", r.wrong_depths},
          {"ao_mae", r.ao_mae},
          {"self_intersections", r.self_intersections},
          {"leaks", r.leaks},
          {"warned", r.warned}};
}

StabilityResult measure_stability(const StabilityCase& stability_case) {
  Scene scene = stability_case.scene;
  move_far_world(scene); // as the importer does
  Diagnostics diagnostics;
  Progress progress;
  const BakedScene baked = bake_to_bytes(scene, {}, diagnostics, progress);
  const BakedFile file = BakedFile::borrow_bytes(baked.bytes, "stability case");
  const PackedSource packed_source(file);
  const FloatSource float_source(scene);
  const PrimaryCamera camera(scene.cameras.at(0), kSize);
  const AoConfig ao = ao_of(stability_case);
  const Traced packed = trace(packed_source, PackedTracer(file, packed_source), camera, ao);
  const Traced floats = trace(float_source, EmbreeTracer(float_source, {}), camera, ao);
  const std::vector<WorldTriangle> triangles = world_triangles(stability_case.scene);
  StabilityResult result;
  result.name = stability_case.name;
  result.triangles = static_cast<uint32_t>(triangles.size());
  result.pixels = static_cast<uint32_t>(kSize.pixels());
  result.warned = !baked.report.warnings.empty() || diagnostics.count(Severity::kWarning) > 0;
  count_pixels(PrimaryCamera(stability_case.scene.cameras.at(0), kSize), triangles, packed.surfaces, result);
  count_occlusion(stability_case.shape, packed, floats, result);
  return result;
}

} // namespace packtrace
