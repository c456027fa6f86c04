#include "runtime/trace/source/float_source.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <string>
#include <utility>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

bool moves(const Scene& scene, uint32_t instance) {
  const std::vector<InstanceMotion>& moving = scene.motion.instances;
  const auto found = std::lower_bound(moving.begin(), moving.end(), instance,
                                      [](const InstanceMotion& one, uint32_t number) { return one.instance < number; });
  return found != moving.end() && found->instance == instance;
}

void require(bool condition, const std::string& message) {
  if (!condition) throw Error(ErrorKind::kInput, message);
}

} // namespace

FloatSource::FloatSource(const Scene& scene) : scene_(scene) {
  geometries_.reserve(scene.shapes.size() + scene.objects.size());
  instances_.reserve(scene.shapes.size() + scene.instances.size());
  for (const Shape& shape : scene.shapes) {
    instances_.push_back({geometry_count(), Affine(1.0f)});
    Shape placed = shape;
    if (moves(scene, static_cast<uint32_t>(instances_.size() - 1))) {
      instances_.back().world_from_object = Affine(shape.parent_from_mesh);
      placed.parent_from_mesh = DAffine(1.0);
    }
    add_geometry({&placed, 1});
  }
  const uint32_t first_object = geometry_count();
  for (const Object& object : scene.objects) add_geometry(object.shapes);
  for (const Instance& instance : scene.instances) {
    require(instance.object < scene.objects.size(), "an instance refers to an object that does not exist");
    instances_.push_back({first_object + instance.object, instance.world_from_object});
  }
  world_bounds_ = packtrace::world_bounds(scene); // The references were checked above.
}

void FloatSource::add_geometry(std::span<const Shape> shapes) {
  Geometry geometry{static_cast<uint32_t>(parts_.size()), static_cast<uint32_t>(shapes.size()), {}};
  uint64_t vertices = 0, triangles = 0;
  for (const Shape& shape : shapes) {
    require(shape.mesh < scene_.meshes.size(), "a shape refers to a mesh that does not exist");
    require(shape.material < scene_.materials.size(), "a shape refers to a material that does not exist");
    Part part;
    part.mesh = &scene_.meshes[shape.mesh];
    part.geometry_from_mesh = shape.parent_from_mesh;
    part.normal_from_mesh = normal_matrix(shape.parent_from_mesh);
    part.material = shape.material;
    part.first_triangle = static_cast<uint32_t>(triangles);
    part.first_vertex = static_cast<uint32_t>(vertices);
    part.swapped = swaps_handedness(shape.parent_from_mesh) != shape.reverse_orientation;
    parts_.push_back(part);
    vertices += part.mesh->positions.size();
    triangles += part.mesh->triangles.size();
    if (std::max(vertices, triangles) > std::numeric_limits<uint32_t>::max())
      throw Error(ErrorKind::kLimitExceeded, part.mesh->name + ": its object has more than 2^32 vertices or triangles");
  }
  geometry.counts = {static_cast<uint32_t>(vertices), static_cast<uint32_t>(triangles)};
  geometries_.push_back(geometry);
}

Triangle FloatSource::Part::triangle(uint32_t triangle_in_mesh) const {
  Triangle vertices = mesh->triangles[triangle_in_mesh];
  if (swapped) std::swap(vertices.y, vertices.z);
  return vertices;
}

void FloatSource::decode(uint32_t geometry, std::span<Vec3> positions, std::span<Triangle> triangles) const {
  const Geometry& g = geometries_[geometry];
  assert(positions.size() == g.counts.vertices && triangles.size() == g.counts.triangles);
  for (uint32_t i = 0; i < g.part_count; ++i) {
    const Part& part = parts_[g.first_part + i];
    Vec3* out = positions.data() + part.first_vertex;
    for (const Vec3 p : part.mesh->positions) *out++ = Vec3(transform_point(part.geometry_from_mesh, DVec3(p)));
    const auto count = static_cast<uint32_t>(part.mesh->triangles.size());
    for (uint32_t t = 0; t < count; ++t)
      triangles[part.first_triangle + t] = part.triangle(t) + Triangle(part.first_vertex);
  }
}

const FloatSource::Part& FloatSource::part_of(uint32_t geometry, uint32_t triangle) const {
  const Geometry& g = geometries_[geometry];
  const auto first = parts_.begin() + g.first_part;
  // Meshes without triangles have the same first_triangle as the next mesh; the last part with that number owns the
  // triangle.
  const auto next = std::upper_bound(first, first + g.part_count, triangle,
                                     [](uint32_t t, const Part& part) { return t < part.first_triangle; });
  return *(next - 1);
}

uint32_t FloatSource::material_of(uint32_t instance, uint32_t triangle) const {
  return part_of(instances_[instance].geometry, triangle).material;
}

std::optional<Vec3> FloatSource::shading_normal(uint32_t geometry, uint32_t triangle, Vec2 barycentrics) const {
  const Part& part = part_of(geometry, triangle);
  if (part.mesh->normals.empty()) return std::nullopt;
  const Triangle v = part.triangle(triangle - part.first_triangle);
  const auto& normals = part.mesh->normals;
  const DVec3 mesh_normal = DVec3(normals[v.x]) * (1.0 - barycentrics.x - barycentrics.y) +
                            DVec3(normals[v.y]) * double(barycentrics.x) + DVec3(normals[v.z]) * double(barycentrics.y);
  const DVec3 n = part.normal_from_mesh * mesh_normal;
  const double length = glm::length(n);
  if (!(length > 0.0) || !std::isfinite(length)) return std::nullopt; // Opposite vertex normals cancel.
  return Vec3(n / length);
}

std::array<Vec2, 3> FloatSource::corner_uvs(uint32_t geometry, uint32_t triangle) const {
  const Part& part = part_of(geometry, triangle);
  if (part.mesh->uvs.empty()) return {Vec2(0), Vec2(0), Vec2(0)};
  const Triangle v = part.triangle(triangle - part.first_triangle);
  const auto& uvs = part.mesh->uvs;
  return {uvs[v.x], uvs[v.y], uvs[v.z]};
}

bool FloatSource::may_emit(uint32_t instance) const {
  const Geometry& g = geometries_[instances_[instance].geometry];
  return std::ranges::any_of(std::span(parts_).subspan(g.first_part, g.part_count),
                             [&](const Part& part) { return scene_.materials[part.material].shading.emits(); });
}

uint64_t FloatSource::resident_bytes() const {
  uint64_t bytes =
      parts_.size() * sizeof(Part) + geometries_.size() * sizeof(Geometry) + instances_.size() * sizeof(PlacedGeometry);
  for (const Mesh& mesh : scene_.meshes)
    bytes += mesh.positions.size() * sizeof(Vec3) + mesh.normals.size() * sizeof(Vec3) +
             mesh.uvs.size() * sizeof(Vec2) + mesh.triangles.size() * sizeof(Triangle);
  for (const AlphaMask& mask : scene_.masks) bytes += mask.words.size() * sizeof(uint32_t);
  for (const AlbedoTexture& texture : scene_.textures) bytes += texture.rgb.size();
  return bytes + map_bytes(scene_.environment_maps);
}

} // namespace packtrace
