#include "tests/benchmarks/packing_benchmark_mesh.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <unordered_map>
#include <utility>
#include <vector>

#include "assets/generator/displaced_mesh.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/import_scene.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/packing_benchmark_grids.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

constexpr std::array<const char*, 3> kSceneNames{"bunny", "spaceship", "house"};

std::vector<Vec3> area_weighted_normals(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles) {
  std::vector<DVec3> sums(positions.size(), DVec3(0.0));
  for (const Triangle& t : triangles) {
    const DVec3 a(positions[t.x]), b(positions[t.y]), c(positions[t.z]);
    const DVec3 twice_area = glm::cross(b - a, c - a);
    for (int corner = 0; corner < 3; ++corner) sums[t[corner]] += twice_area;
  }
  std::vector<Vec3> normals;
  normals.reserve(sums.size());
  for (const DVec3 sum : sums)
    normals.push_back(glm::length(sum) > 0.0 ? Vec3(glm::normalize(sum)) : Vec3(0.0f, 0.0f, 1.0f));
  return normals;
}

void append(const Shape& shape, const Mesh& source, bool with_uvs, Mesh& out) {
  const auto first = static_cast<uint32_t>(out.positions.size());
  for (const Vec3 p : source.positions) out.positions.emplace_back(transform_point(shape.parent_from_mesh, DVec3(p)));
  const bool turned = shape.reverse_orientation != swaps_handedness(shape.parent_from_mesh);
  for (Triangle t : source.triangles) {
    if (turned) std::swap(t.y, t.z);
    out.triangles.push_back(t + first);
  }
  std::vector<Vec3> normals;
  if (source.normals.empty()) {
    normals = area_weighted_normals(source.positions, source.triangles);
    if (shape.reverse_orientation)
      for (Vec3& n : normals) n = -n;
  } else {
    normals = source.normals;
  }
  const glm::dmat3 world_from_normal = normal_matrix(shape.parent_from_mesh);
  for (const Vec3 n : normals) out.normals.emplace_back(glm::normalize(world_from_normal * DVec3(n)));
  if (!with_uvs) return;
  out.uvs.insert(out.uvs.end(), source.uvs.begin(), source.uvs.end());
  out.uvs.resize(out.positions.size(), Vec2(0.0f));
}

struct BitHash {
  size_t operator()(const std::array<uint32_t, 3>& bits) const {
    uint64_t hash = 0;
    for (const uint32_t word : bits) hash = (hash ^ word) * 0x9e3779b97f4a7c15u, hash ^= hash >> 29;
    return hash;
  }
};

/// @param largest_only keeps only the shape with the most triangles, for example to drop the plane below a scan
PackingInput load_packing_input(const std::string& name, const std::filesystem::path& main_file, bool largest_only) {
  Diagnostics diagnostics;
  Progress progress;
  PackingInput input{name, import_scene(main_file, {}, diagnostics, progress).scene, {}};
  std::vector<Shape>& shapes = input.scene.shapes;
  if (largest_only && !shapes.empty()) {
    const auto size = [&](const Shape& shape) { return input.scene.meshes[shape.mesh].triangles.size(); };
    shapes = {*std::max_element(shapes.begin(), shapes.end(),
                                [&](const Shape& a, const Shape& b) { return size(a) < size(b); })};
  }
  input.mesh = merge_world(input.scene);
  if (input.mesh.triangles.empty())
    throw Error(ErrorKind::kInput, main_file.string() + ": no triangles outside objects");
  return input;
}

PackingInput generated_packing_input(uint64_t triangles, const std::filesystem::path& folder) {
  scenegen::DisplacedMeshConfig config;
  config.triangles = triangles;
  scenegen::generate_displaced_mesh(config, {folder, true});
  return load_packing_input("generated", folder / "mesh.pbrt", false);
}

PackingInput grid_packing_input(const std::string& name) {
  PackingInput input{name, {}, {}};
  input.scene.meshes.push_back(make_grid_input(name));
  input.scene.materials.emplace_back();
  input.scene.shapes.emplace_back();
  input.mesh = merge_world(input.scene);
  return input;
}

} // namespace

Mesh merge_world(const Scene& scene) {
  Mesh out;
  const bool with_uvs = std::any_of(scene.shapes.begin(), scene.shapes.end(),
                                    [&](const Shape& shape) { return !scene.meshes[shape.mesh].uvs.empty(); });
  for (const Shape& shape : scene.shapes) append(shape, scene.meshes[shape.mesh], with_uvs, out);
  return out;
}

Mesh weld_positions(const Mesh& mesh) {
  Mesh out;
  std::unordered_map<std::array<uint32_t, 3>, uint32_t, BitHash> numbers;
  numbers.reserve(mesh.positions.size());
  std::vector<uint32_t> welded;
  welded.reserve(mesh.positions.size());
  for (const Vec3 given : mesh.positions) {
    const Vec3 p = given + 0.0f; // turns -0 into 0
    std::array<uint32_t, 3> bits{};
    std::memcpy(bits.data(), &p, sizeof(bits));
    const auto [entry, is_new] = numbers.try_emplace(bits, static_cast<uint32_t>(out.positions.size()));
    if (is_new) out.positions.push_back(p);
    welded.push_back(entry->second);
  }
  out.triangles.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) out.triangles.emplace_back(welded[t.x], welded[t.y], welded[t.z]);
  return out;
}

PackingInput find_packing_input(const std::string& name, const std::filesystem::path& scenes,
                                uint64_t generated_triangles) {
  if (const auto grids = grid_input_names(); std::ranges::find(grids, name) != grids.end())
    return grid_packing_input(name);
  if (name == "generated") {
    const TemporaryFolder folder;
    return generated_packing_input(generated_triangles, folder.path());
  }
  if (std::ranges::find(kSceneNames, name) != kSceneNames.end())
    return load_packing_input(name, scenes / name / "scene.pbrt", name == "bunny");
  return load_packing_input(name, name, false);
}

void PackingInputs::add_to(BenchmarkOptions& command_line) {
  command_line.add("--scenes", scenes, "holds bunny, spaceship and house").environment("PACKTRACE_SCENES");
  command_line.add("--generated-triangles", generated_triangles, "of the generated mesh").show_default();
  std::vector<std::string> known(kSceneNames.begin(), kSceneNames.end());
  known.insert(known.end(), {"generated", "grids"});
  known.insert(known.end(), grid_input_names().begin(), grid_input_names().end());
  command_line
      .add("INPUT", names,
           "which, or scenes and mesh files; `grids` are all grid-...; if none is named, all but grids and files")
      .one_of_or_file(known);
}

void PackingInputs::choose() {
  if (const auto grids = std::ranges::find(names, "grids"); grids != names.end()) {
    const auto at = names.erase(grids);
    names.insert(at, grid_input_names().begin(), grid_input_names().end());
  }
  if (!names.empty()) return;
  names = {"generated"};
  if (!scenes.empty()) names.insert(names.begin(), kSceneNames.begin(), kSceneNames.end());
}

double median_edge(const Mesh& mesh) {
  std::vector<double> lengths;
  lengths.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    for (int corner = 0; corner < 3; ++corner) {
      const double length = glm::distance(DVec3(mesh.positions[t[corner]]), DVec3(mesh.positions[t[(corner + 1) % 3]]));
      if (length > 0.0) lengths.push_back(length);
    }
  if (lengths.empty()) return 0.0;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

PackingBox packing_box(const Mesh& mesh) {
  const Bounds box = bounds_of(mesh.positions);
  const DVec3 size = box.extent();
  return {box.empty() ? Vec3(0.0f) : Vec3(box.lo), std::max({size.x, size.y, size.z})};
}

} // namespace packtrace
