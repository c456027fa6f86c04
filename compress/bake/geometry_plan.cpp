#include "compress/bake/geometry_plan.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <tuple>

#include <tbb/parallel_for.h>
#include <xxhash.h>

#include "pbrt_import/scene/error.h"

namespace packtrace {
namespace {

template <typename T>
size_t byte_size(const std::vector<T>& v) {
  return v.size() * sizeof(T);
}

template <typename T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), byte_size(a)) == 0);
}

bool same_content(const Mesh& a, const Mesh& b) {
  return same_bytes(a.positions, b.positions) && same_bytes(a.normals, b.normals) && same_bytes(a.uvs, b.uvs) &&
         same_bytes(a.triangles, b.triangles);
}

std::pair<uint64_t, uint64_t> content_hash(const Mesh& mesh) {
  const auto hash = [](const auto& v) { return XXH3_128bits(v.data(), byte_size(v)); };
  const std::array<XXH128_hash_t, 4> parts = {hash(mesh.positions), hash(mesh.normals), hash(mesh.uvs),
                                              hash(mesh.triangles)};
  const XXH128_hash_t all = XXH3_128bits(parts.data(), sizeof parts);
  return {all.high64, all.low64};
}

/// For each mesh the first mesh with equal content.
std::vector<uint32_t> first_equal_meshes(const Scene& scene) {
  std::vector<std::pair<uint64_t, uint64_t>> hashes(scene.meshes.size());
  tbb::parallel_for(size_t{0}, hashes.size(), [&](size_t i) { hashes[i] = content_hash(scene.meshes[i]); });
  std::map<std::pair<uint64_t, uint64_t>, uint32_t> first_with;
  std::vector<uint32_t> result(hashes.size());
  for (uint32_t i = 0; i < result.size(); ++i) {
    const uint32_t first = first_with.try_emplace(hashes[i], i).first->second;
    result[i] = same_content(scene.meshes[first], scene.meshes[i]) ? first : i;
  }
  return result;
}

bool same_transform(const DAffine& a, const DAffine& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// Largest sum of absolute values in a row of the linear part.
double stretch(const std::array<float, 12>& m) {
  double largest = 0.0;
  for (size_t row = 0; row < 3; ++row)
    largest = std::max(largest, std::abs(double{m[row]}) + std::abs(double{m[3 + row]}) + std::abs(double{m[6 + row]}));
  return largest;
}

baked::InstanceRecord instance_of(uint32_t geometry, const Affine& world_from_object) {
  baked::InstanceRecord record{};
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row)
      record.world_from_object[static_cast<size_t>(3 * column + row)] = world_from_object[column][row];
  record.geometry = geometry;
  return record;
}

class Planner {
public:
  explicit Planner(const Scene& scene) : scene_(scene) {}

  ScenePlan run() {
    check();
    equal_mesh_ = first_equal_meshes(scene_);
    plan_world_shapes();
    plan_objects();
    return std::move(plan_);
  }

private:
  void require(bool ok, const std::string& what) const {
    if (!ok) throw Error(ErrorKind::kInput, "invalid scene: " + what);
  }

  void check() const {
    const auto check_shape = [&](const Shape& shape) {
      require(shape.mesh < scene_.meshes.size(), "a shape's mesh does not exist");
      require(shape.material < scene_.materials.size(), "a shape's material does not exist");
      for (int column = 0; column < 4; ++column)
        require(is_finite(shape.parent_from_mesh[column]),
                "a transform of " + scene_.meshes[shape.mesh].name + " is not finite");
    };
    for (const Shape& shape : scene_.shapes) check_shape(shape);
    for (const Object& object : scene_.objects)
      for (const Shape& shape : object.shapes) check_shape(shape);
    for (const Instance& instance : scene_.instances) {
      require(instance.object < scene_.objects.size(), "an instance's object does not exist");
      for (int column = 0; column < 4; ++column)
        require(is_finite(instance.world_from_object[column]),
                "the transform of an instance of " + scene_.objects[instance.object].name + " is not finite");
    }
  }

  uint32_t add_geometry(GeometryPlan plan) {
    plan_.geometries.push_back(std::move(plan));
    return static_cast<uint32_t>(plan_.geometries.size() - 1);
  }

  /// One group of world shapes with equal content, material and orientation.
  struct Group {
    uint32_t shapes = 0;
    bool one_transform = true;
    DAffine transform{1.0}; ///< of the first
    std::optional<uint32_t> geometry;
  };
  using GroupKey = std::tuple<uint32_t, uint32_t, bool>;

  void plan_world_shapes() {
    const auto key_of = [&](const Shape& s) {
      return GroupKey(equal_mesh_[s.mesh], s.material, s.reverse_orientation);
    };
    std::map<GroupKey, Group> groups;
    for (const Shape& shape : scene_.shapes) {
      Group& group = groups[key_of(shape)];
      if (group.shapes++ == 0)
        group.transform = shape.parent_from_mesh;
      else
        group.one_transform &= same_transform(group.transform, shape.parent_from_mesh);
    }
    for (const Shape& shape : scene_.shapes) {
      Group& group = groups[key_of(shape)];
      const Mesh& mesh = scene_.meshes[shape.mesh];
      const bool share = group.shapes > 1 && (group.one_transform || mesh.triangles.size() >= kMinSharedTriangles);
      const bool local = share && !group.one_transform;
      plan_.shared_shapes += share && group.geometry;
      uint32_t geometry = group.geometry.value_or(0);
      if (!share || !group.geometry) {
        const bool mirrored = !local && swaps_handedness(shape.parent_from_mesh);
        geometry = add_geometry({mesh.name,
                                 {{shape.mesh, shape.material, shape.reverse_orientation != mirrored,
                                   local ? DAffine(1.0) : shape.parent_from_mesh}},
                                 !local,
                                 local ? 0.0 : 1.0});
        if (share) group.geometry = geometry;
      }
      add_instance(geometry, local ? Affine(shape.parent_from_mesh) : Affine(1.0f));
    }
  }

  void add_instance(uint32_t geometry, const Affine& world_from_object) {
    for (int column = 0; column < 4; ++column)
      require(is_finite(world_from_object[column]),
              "the transform of an instance of " + plan_.geometries[geometry].name + " exceeds the float range");
    plan_.instances.push_back(instance_of(geometry, world_from_object));
    GeometryPlan& plan = plan_.geometries[geometry];
    plan.max_stretch = std::max(plan.max_stretch, stretch(plan_.instances.back().world_from_object));
  }

  /// Bytes that are equal for objects with equal content.
  std::string object_key(const Object& object) const {
    std::string key;
    const auto append = [&key](const auto& value) { key.append(reinterpret_cast<const char*>(&value), sizeof value); };
    for (const Shape& shape : object.shapes) {
      append(equal_mesh_[shape.mesh]);
      append(shape.material);
      append(static_cast<uint8_t>(shape.reverse_orientation));
      append(shape.parent_from_mesh);
    }
    return key;
  }

  void plan_objects() {
    std::vector<uint8_t> used(scene_.objects.size());
    for (const Instance& instance : scene_.instances) used[instance.object] = 1;
    std::map<std::string, uint32_t> geometry_with;
    std::vector<uint32_t> geometry_of(scene_.objects.size());
    for (size_t i = 0; i < scene_.objects.size(); ++i) {
      const Object& object = scene_.objects[i];
      if (used[i] == 0) {
        ++plan_.unused_objects;
        for (const Shape& shape : object.shapes) plan_.unused_triangles += scene_.meshes[shape.mesh].triangles.size();
        continue;
      }
      const auto next = static_cast<uint32_t>(plan_.geometries.size());
      const auto [found, inserted] = geometry_with.try_emplace(object_key(object), next);
      geometry_of[i] = found->second;
      if (!inserted) {
        ++plan_.shared_objects;
        continue;
      }
      GeometryPlan plan{object.name, {}, false, 0.0};
      for (const Shape& shape : object.shapes)
        plan.parts.push_back({shape.mesh, shape.material,
                              shape.reverse_orientation != swaps_handedness(shape.parent_from_mesh),
                              shape.parent_from_mesh});
      add_geometry(std::move(plan));
    }
    for (const Instance& instance : scene_.instances)
      add_instance(geometry_of[instance.object], instance.world_from_object);
  }

  const Scene& scene_;
  std::vector<uint32_t> equal_mesh_;
  ScenePlan plan_;
};

} // namespace

ScenePlan plan_scene(const Scene& scene) { return Planner(scene).run(); }

} // namespace packtrace
