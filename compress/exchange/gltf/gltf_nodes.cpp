#include "compress/exchange/gltf/gltf_nodes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "pbrt_import/base/printable.h"

namespace packtrace {
namespace {

constexpr double kNear = 1e-4, kFar = 10.0; // near and far planes relative to the scene's diagonal; pbrt has none
constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";
constexpr int kRoot = 0;
constexpr double kScreenLines = 1080.0; // for which levels of detail state their coverage

/// A node's map, as the shortest of nothing, scale and translation, or matrix.
void set_map(GltfJson& node, const DAffine& map) {
  if (map == DAffine(1.0)) return;
  const double s = map[0].x;
  if (s > 0.0 && map[0] == DVec3(s, 0, 0) && map[1] == DVec3(0, s, 0) && map[2] == DVec3(0, 0, s)) {
    if (s != 1.0) node["scale"] = {s, s, s};
    if (map[3] != DVec3(0.0)) node["translation"] = {map[3].x, map[3].y, map[3].z};
    return;
  }
  GltfJson matrix = GltfJson::array();
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) matrix.push_back(map[column][row]);
    matrix.push_back(column == 3 ? 1 : 0);
  }
  node["matrix"] = std::move(matrix);
}

DAffine map_of(const baked::InstanceRecord& instance) {
  const std::array<float, 12>& m = instance.world_from_object;
  return {m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9], m[10], m[11]};
}

} // namespace

void GltfNodes::add_all(const std::vector<bool>& is_merged) {
  GltfJson root{{"scale", {-1, 1, 1}}};
  if (config_.names) root["name"] = "world";
  if (const DVec3 origin = file_.origin(); origin != DVec3(0.0)) root["translation"] = {-origin.x, origin.y, origin.z};
  children_ = meshes_.world_nodes();
  std::map<int, std::vector<uint32_t>> groups; // instances by mesh
  for (uint32_t i = 0; i < file_.instances().size(); ++i)
    if (!is_merged[i]) add_instance(i, groups);
  for (const auto& [mesh, instances] : groups) add_group(mesh, instances);
  for (const Camera& camera : file_.cameras()) add_camera(camera);
  if (!children_.empty()) root["children"] = children_;
  model_.element("nodes", kRoot) = std::move(root);
}

void GltfNodes::add_instance(uint32_t number, std::map<int, std::vector<uint32_t>>& groups) {
  const baked::InstanceRecord& instance = file_.instances()[number];
  const std::optional<int> mesh = meshes_.mesh_of(instance.geometry, instance.first_slot);
  if (!mesh) return;
  const bool has_levels = config_.levels && file_.lod(instance.geometry).levels.size() > 1;
  const DAffine map = map_of(instance);
  if (config_.instancing && !has_levels &&
      decompose_instance(compose(map, meshes_.object_from_stored(instance.geometry))))
    return groups[*mesh].push_back(number);
  GltfJson node{{"mesh", *mesh}};
  set_map(node, compose(map, meshes_.object_from_stored(instance.geometry)));
  if (has_levels) add_levels(instance, node);
  add_node(std::move(node));
}

/// Adds the levels of an instance as nodes. A level may be shown while its error is at most a pixel of a screen of
/// kScreenLines lines. Coverage is the height of the object's sphere relative to the screen's.
/// Source: MSFT_lod; Microsoft, glTF toolkit, 2018.
void GltfNodes::add_levels(const baked::InstanceRecord& instance, GltfJson& node) {
  const LodView lod = file_.lod(instance.geometry);
  const Bounds box = object_bounds(file_.geometries()[instance.geometry]);
  GltfJson ids = GltfJson::array(), coverage = GltfJson::array();
  for (const baked::LodLevelRecord& level : lod.levels) {
    const std::optional<int> mesh = meshes_.mesh_of(level.geometry, instance.first_slot);
    if (!mesh) break;
    if (level.level > 0) {
      coverage.push_back(std::min(1.0, box.diagonal() / (double{level.error} * kScreenLines)));
      GltfJson coarser{{"mesh", *mesh}};
      set_map(coarser, compose(map_of(instance), meshes_.object_from_stored(level.geometry)));
      ids.push_back(model_.add("nodes", std::move(coarser)));
    }
  }
  if (ids.empty()) return;
  coverage.push_back(0.0);
  report_.levels += ids.size();
  node["extensions"]["MSFT_lod"] = {{"ids", std::move(ids)}};
  node["extras"]["MSFT_screencoverage"] = std::move(coverage);
  model_.use_extension("MSFT_lod", false);
}

/// Adds a node for all instances of a mesh; a single one needs no extension.
void GltfNodes::add_group(int mesh, const std::vector<uint32_t>& instances) {
  const uint32_t geometry = file_.instances()[instances.front()].geometry;
  const DAffine& object_from_stored = meshes_.object_from_stored(geometry);
  std::vector<DAffine> maps;
  for (const uint32_t i : instances) maps.push_back(map_of(file_.instances()[i]));
  const bool in_place = std::ranges::all_of(maps, [](const DAffine& map) { return map == DAffine(1.0); });
  if (maps.size() == 1 || in_place) {
    for (const DAffine& map : maps) {
      GltfJson node{{"mesh", mesh}};
      set_map(node, compose(map, object_from_stored));
      add_node(std::move(node));
    }
    return;
  }
  for (DAffine& map : maps) map = compose(map, object_from_stored);
  InstanceAttributes instanced(maps);
  GltfJson attributes;
  if (config_.codec == GltfCodec::kMeshopt) {
    Bounds box = object_bounds(file_.geometries()[geometry]);
    const double step = object_from_stored[0].x;
    box.lo = (box.lo - object_from_stored[3]) / step, box.hi = (box.hi - object_from_stored[3]) / step;
    report_.max_placement_error =
        std::max(report_.max_placement_error, instanced.add_coded(box, meshes_.streams(), attributes));
  } else {
    report_.geometry_bytes += instanced.add_floats(model_, attributes);
  }
  model_.use_extension(kInstancing, true);
  report_.grouped_instances += maps.size();
  add_node({{"mesh", mesh}, {"extensions", {{kInstancing, {{"attributes", std::move(attributes)}}}}}});
}

void GltfNodes::add_camera(const Camera& camera) {
  if (camera.projection == Projection::kEnvironment || camera.width_px == 0 || camera.height_px == 0) {
    ++report_.skipped_cameras;
    return;
  }
  const double aspect = double(camera.width_px) / double(camera.height_px);
  // Half size of the screen. An off-centre window becomes centred.
  glm::dvec2 half(std::max(aspect, 1.0), std::max(1.0 / aspect, 1.0));
  if (camera.screen_window)
    half = glm::abs(glm::dvec2(camera.screen_window->y - camera.screen_window->x,
                               camera.screen_window->w - camera.screen_window->z)) *
           0.5;
  GltfJson out;
  if (camera.projection == Projection::kPerspective) {
    const double tangent = std::tan(camera.fov_degrees * std::numbers::pi / 360.0);
    out = {{"type", "perspective"},
           {"perspective",
            {{"yfov", 2.0 * std::atan(half.y * tangent)},
             {"aspectRatio", half.x / half.y},
             {"znear", kNear * scene_size()},
             {"zfar", kFar * scene_size()}}}};
  } else {
    out = {{"type", "orthographic"},
           {"orthographic", {{"xmag", half.x}, {"ymag", half.y}, {"znear", 0}, {"zfar", kFar * scene_size()}}}};
  }
  if (config_.names) out["name"] = to_utf8(camera.film_name);
  GltfJson node{{"camera", model_.add("cameras", std::move(out))}};
  const DAffine& m = camera.world_from_camera; // glTF's cameras look along -z
  set_map(node, DAffine(m[0], m[1], -m[2], m[3]));
  add_node(std::move(node));
}

/// Diagonal of the scene in world units, or 1 if it is 0.
double GltfNodes::scene_size() const {
  const double diagonal = file_.world_bounds().diagonal();
  return diagonal > 0.0 ? diagonal : 1.0;
}

} // namespace packtrace
