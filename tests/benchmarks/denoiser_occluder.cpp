#include "tests/benchmarks/denoiser_occluder.h"

#include <algorithm>

#include "pbrt_import/base/error.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/frame/camera_path.h"
#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {
namespace {

/// A cube around the origin, with normals that point outwards.
Mesh cube(float half_side) {
  Mesh mesh;
  mesh.name = "occluder";
  for (int corner = 0; corner < 8; ++corner)
    mesh.positions.push_back(half_side *
                             Vec3((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1));
  for (const auto& [a, b, c, d] :
       {std::array<uint32_t, 4>{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  return mesh;
}

Affine translated(DVec3 to) {
  Affine placed(1.0f);
  placed[3] = Vec3(to);
  return placed;
}

} // namespace

Camera first_camera(const SceneSource& source, ImageSize size, bool framed) {
  return framed || source.cameras().empty() ? framing_camera(source.world_bounds(), size, source.cameras())
                                            : source.cameras()[0];
}

Affine Occluder::at(uint32_t f, uint32_t frames) const {
  return translated(glm::mix(first, last, static_cast<double>(f) / std::max(frames - 1.0, 1.0)));
}

SceneWithOccluder::SceneWithOccluder(const std::string& name, const TraceInputOptions& inputs, ImageSize size,
                                     bool framed) {
  Scene scene = load_trace_scene(name, inputs);
  Camera camera;
  GBuffer g;
  Bounds world;
  {
    const TraceInput empty(name, bake_trace_scene(scene, name));
    camera = first_camera(empty.source, size, framed);
    world = empty.source.world_bounds();
    const PrimaryCamera view(camera, size);
    Progress progress;
    trace_primary(empty.source, PackedTracer(empty.file, empty.source), view, view, g, progress);
  }
  const size_t middle = size_t{size.height / 2} * size.width + size.width / 2;
  if (!(g.view_z[middle] > 0.0f)) throw Error(ErrorKind::kUsage, name + ": nothing is in the middle of the view");
  // A tenth of the image is its side, half of that its distance from the surface.
  const double pixel = double{g.pixel_spread} * double{g.view_z[middle]}, side = 0.1 * size.height * pixel;
  const DVec3 right = glm::normalize(DVec3(camera.world_from_camera[0]));
  const DVec3 forward = glm::normalize(DVec3(camera.world_from_camera[2]));
  const DVec3 eye = DVec3(camera.world_from_camera[3]);
  const DVec3 centre = DVec3(g.position[middle]) + side * DVec3(g.geometric_normal[middle]);
  const double way = 0.1 * size.width * pixel;
  box.first = centre - 0.5 * way * right, box.last = centre + 0.5 * way * right;
  const DVec3 behind = eye - (1.5 * double{ao_radius({}, world)} + side) * forward;
  box.gone = translated(behind);

  scene.meshes.push_back(cube(static_cast<float>(0.5 * side)));
  Object object;
  object.name = "occluder";
  object.shapes.emplace_back(static_cast<uint32_t>(scene.meshes.size() - 1),
                             static_cast<uint32_t>(scene.materials.size()), false, DAffine(1.0));
  scene.materials.emplace_back();
  scene.objects.push_back(std::move(object));
  scene.instances.push_back({static_cast<uint32_t>(scene.objects.size() - 1), translated(box.first)});
  traced = std::make_unique<TraceInput>(name, bake_trace_scene(scene, name));
  const auto instances = traced->source.instances();
  box.instance = static_cast<uint32_t>(instances.size() - 1);
  for (const DVec3 place : {box.first, box.last, behind})
    movers.world.extend(Vec3(place - DVec3(side))), movers.world.extend(Vec3(place + DVec3(side)));
  movers.instances = {box.instance};
}

} // namespace packtrace
