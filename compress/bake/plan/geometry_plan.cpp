#include "compress/bake/plan/geometry_plan.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <tuple>

#include <tbb/parallel_for.h>

#include "compress/bake/plan/equal_meshes.h"
#include "compress/bake/plan/material_runs.h"
#include "pbrt_import/base/brief.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/motion_pose.h"

namespace packtrace {
namespace {

// NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): equal bits are meant
bool same_transform(const DAffine& a, const DAffine& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// Largest absolute row sum of the linear part: scales an error per object axis to an error per world axis.
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
  Planner(const Scene& scene, std::span<const uint32_t> deforming, std::span<const LevelChain> chains)
      : scene_(scene), chains_(chains), deforms_(scene.meshes.size(), 0) {
    for (const uint32_t mesh : deforming) deforms_[mesh] = 1;
  }

  ScenePlan run() {
    check();
    equal_mesh_ = first_equal_meshes(scene_);
    separate_deforming_meshes();
    find_moving();
    find_mesh_boxes();
    find_used_objects();
    plan_world_shapes();
    plan_objects();
    MaterialRuns runs(plan_);
    for (uint32_t g = 0; g < users_.size(); ++g) runs.assign_slots(scene_, g, users_[g]);
    for (size_t i = 0; i < plan_.instances.size(); ++i) {
      baked::InstanceRecord& instance = plan_.instances[i];
      if (instance.geometry == baked::kNone) continue;
      instance.first_slot = users_[instance.geometry].first_slot[user_of_[i]];
    }
    plan_chains();
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

  uint32_t class_of(const Shape& shape) const { return baked::material_class(scene_.materials[shape.material].flags); }

  uint32_t add_geometry(GeometryPlan plan) {
    plan_.geometries.push_back(std::move(plan));
    users_.emplace_back();
    return static_cast<uint32_t>(plan_.geometries.size() - 1);
  }

  /// @return the number of the new user
  uint32_t add_user(uint32_t geometry, std::span<const Shape> shapes) {
    GeometryUsers& users = users_[geometry];
    for (const Shape& shape : shapes) users.part_materials.push_back(shape.material);
    return users.count++;
  }

  /// A moving mesh is not merged with equal meshes. Of those, the first that does not move replaces the others.
  void separate_deforming_meshes() {
    std::map<uint32_t, uint32_t> first_still;
    for (uint32_t i = 0; i < equal_mesh_.size(); ++i)
      equal_mesh_[i] = deforms_[i] != 0 ? i : first_still.try_emplace(equal_mesh_[i], i).first->second;
  }

  void find_moving() {
    moving_.resize(scene_.shapes.size() + scene_.instances.size(), nullptr);
    for (const InstanceMotion& moving : scene_.motion.instances) {
      const auto track_ok = [&](uint32_t track) {
        return track < scene_.motion.tracks.size() && !scene_.motion.tracks[track].keys.empty();
      };
      require(moving.instance < moving_.size(), "an instance that moves does not exist");
      require(track_ok(moving.track) && (moving.inner_track == kNoTrack || track_ok(moving.inner_track)),
              "the keys of an instance that moves do not exist");
      moving_[moving.instance] = &moving;
    }
  }

  void find_mesh_boxes() {
    mesh_boxes_.resize(scene_.meshes.size());
    tbb::parallel_for(size_t{0}, mesh_boxes_.size(),
                      [&](size_t i) { mesh_boxes_[i] = bounds_of(scene_.meshes[i].positions); });
  }

  /// Returns a shape's bounds where it is placed if they exceed the float range.
  std::optional<Bounds> beyond_range(const Shape& shape) const {
    const Bounds& mesh_box = mesh_boxes_[shape.mesh];
    if (mesh_box.empty() || !within_float_range(mesh_box)) return {}; // invalid mesh: measure_geometry() rejects it
    if (within_float_range(transform_bounds(shape.parent_from_mesh, mesh_box))) return {};
    Bounds box; // exact bounds instead of the transformed box
    for (const Vec3 p : scene_.meshes[shape.mesh].positions)
      box.extend(transform_point(shape.parent_from_mesh, DVec3(p)));
    if (within_float_range(box)) return {};
    return box;
  }

  /// Adds an instance without geometry, so that later instances keep their numbers.
  void leave_out(std::string what) {
    plan_.left_out.push_back(std::move(what));
    plan_.instances.push_back(instance_of(baked::kNone, Affine(1.0f)));
    user_of_.push_back(0);
  }

  void add_instance(uint32_t geometry, uint32_t user, const Affine& world_from_object) {
    const InstanceMotion* const moving = moving_[plan_.instances.size()];
    for (int column = 0; column < 4; ++column)
      if (!is_finite(world_from_object[column]))
        return leave_out("an instance of " + plan_.geometries[geometry].name +
                         " leaves the float range: so does its transform");
    plan_.instances.push_back(instance_of(geometry, world_from_object));
    user_of_.push_back(user);
    GeometryPlan& plan = plan_.geometries[geometry];
    plan.max_stretch = std::max(plan.max_stretch, stretch(plan_.instances.back().world_from_object));
    if (moving != nullptr)
      plan.max_stretch = std::max(plan.max_stretch, largest_stretch(scene_.motion, *moving, world_from_object));
  }

  /// World shapes, and objects that consist of one shape at the identity, with equal content, material class and
  /// orientation.
  struct Group {
    uint32_t shapes = 0, objects = 0;
    bool one_transform = true; ///< all shapes have the same transform
    bool one_mesh = false;     ///< several of them use the same mesh index
    DAffine transform{1.0};    ///< transform of the first shape
    std::optional<uint32_t> geometry;

    bool shared() const { return shapes + objects > 1; }
    /// Whether its shapes become instances with their own grid.
    bool instanced(size_t triangles) const {
      return shared() && !(one_transform && objects == 0) && (one_mesh || triangles >= kMinSharedTriangles);
    }
  };
  using GroupKey = std::tuple<uint32_t, uint32_t, bool>;

  GroupKey key_of(const Shape& s) const { return GroupKey(equal_mesh_[s.mesh], class_of(s), s.reverse_orientation); }

  std::map<GroupKey, Group> group_shapes() const {
    std::map<GroupKey, Group> groups;
    std::vector<uint8_t> mesh_seen(scene_.meshes.size());
    const auto add = [&](const Shape& shape) -> Group& {
      Group& group = groups[key_of(shape)];
      group.one_mesh |= mesh_seen[shape.mesh] != 0;
      mesh_seen[shape.mesh] = 1;
      return group;
    };
    for (size_t i = 0; i < scene_.shapes.size(); ++i) {
      const Shape& shape = scene_.shapes[i];
      if (moving_[i] != nullptr || beyond_range(shape)) continue;
      Group& group = add(shape);
      if (group.shapes++ == 0)
        group.transform = shape.parent_from_mesh;
      else
        group.one_transform &= same_transform(group.transform, shape.parent_from_mesh);
    }
    for (size_t i = 0; i < scene_.objects.size(); ++i) {
      const std::vector<Shape>& shapes = scene_.objects[i].shapes;
      if (used_[i] != 0 && shapes.size() == 1 && same_transform(shapes[0].parent_from_mesh, DAffine(1.0)))
        ++add(shapes[0]).objects;
    }
    return groups;
  }

  void plan_world_shapes() {
    std::map<GroupKey, Group> groups = group_shapes();
    for (const Shape& shape : scene_.shapes) {
      if (const std::optional<Bounds> box = beyond_range(shape)) {
        leave_out(beyond_float_range(scene_.meshes[shape.mesh].name, *box));
        continue;
      }
      if (moving_[plan_.instances.size()] != nullptr) {
        place_moving_shape(shape);
        continue;
      }
      Group& group = groups[key_of(shape)];
      const bool instanced = deforms_[shape.mesh] != 0 || group.instanced(scene_.meshes[shape.mesh].triangles.size());
      const bool share = instanced || (group.shapes > 1 && group.one_transform);
      plan_.shared_shapes += share && group.geometry;
      plan_.instanced_shapes += instanced && deforms_[shape.mesh] == 0;
      Shape placed = shape;
      if (instanced) placed.parent_from_mesh = DAffine(1.0);
      uint32_t geometry = group.geometry.value_or(0);
      if (!share || !group.geometry) {
        geometry = add_geometry(plan_of(scene_.meshes[shape.mesh].name, {&placed, 1}));
        plan_.geometries.back().world_space = !instanced;
        plan_.geometries.back().max_stretch = instanced ? 0.0 : 1.0;
        if (share) group.geometry = geometry;
        if (instanced) geometry_with_[content_key({&placed, 1})] = geometry;
      }
      add_instance(geometry, add_user(geometry, {&placed, 1}),
                   instanced ? Affine(shape.parent_from_mesh) : Affine(1.0f));
    }
  }

  /// Gives a moving shape a geometry with its own grid, like that of an object.
  void place_moving_shape(Shape shape) {
    const Affine placement(shape.parent_from_mesh);
    shape.parent_from_mesh = DAffine(1.0);
    const auto next = static_cast<uint32_t>(plan_.geometries.size());
    const auto [found, inserted] = geometry_with_.try_emplace(content_key({&shape, 1}), next);
    if (inserted) add_geometry(plan_of(scene_.meshes[shape.mesh].name, {&shape, 1}));
    plan_.shared_shapes += !inserted;
    add_instance(found->second, add_user(found->second, {&shape, 1}), placement);
  }

  GeometryPlan plan_of(const std::string& name, std::span<const Shape> shapes) const {
    GeometryPlan plan;
    plan.name = name;
    plan.max_stretch = 0.0;
    for (const Shape& shape : shapes)
      plan.parts.push_back({shape.mesh, 0, shape.reverse_orientation != swaps_handedness(shape.parent_from_mesh),
                            shape.parent_from_mesh});
    for (const Shape& shape : shapes) plan.deforms |= deforms_[shape.mesh] != 0;
    return plan;
  }

  /// Returns bytes that are equal for objects that can share a geometry.
  std::string content_key(std::span<const Shape> shapes) const {
    std::string key;
    const auto append = [&key](const auto& value) { key.append(reinterpret_cast<const char*>(&value), sizeof value); };
    for (const Shape& shape : shapes) {
      append(equal_mesh_[shape.mesh]);
      append(class_of(shape));
      append(static_cast<uint8_t>(shape.reverse_orientation));
      append(shape.parent_from_mesh);
    }
    return key;
  }

  void find_used_objects() {
    used_.resize(scene_.objects.size());
    for (const Instance& instance : scene_.instances) used_[instance.object] = 1;
    for (const LevelChain& chain : chains_)
      for (const uint32_t object : chain.objects) {
        require(object < used_.size(), "an object of a level chain does not exist");
        used_[object] = 1;
      }
  }

  void plan_objects() {
    std::vector<Use>& use_of = use_of_object_;
    use_of.resize(scene_.objects.size());
    for (size_t i = 0; i < scene_.objects.size(); ++i) {
      Object object = scene_.objects[i];
      if (used_[i] == 0) {
        ++plan_.unused_objects;
        for (const Shape& shape : object.shapes) plan_.unused_triangles += scene_.meshes[shape.mesh].triangles.size();
        continue;
      }
      std::erase_if(object.shapes, [&](const Shape& shape) {
        const std::optional<Bounds> box = beyond_range(shape);
        if (box)
          plan_.left_out.push_back(beyond_float_range(scene_.meshes[shape.mesh].name + " of " + object.name, *box));
        return box.has_value();
      });
      const auto next = static_cast<uint32_t>(plan_.geometries.size());
      const auto [found, inserted] = geometry_with_.try_emplace(content_key(object.shapes), next);
      if (inserted)
        add_geometry(plan_of(object.name, object.shapes));
      else
        ++plan_.shared_objects;
      use_of[i] = {found->second, add_user(found->second, object.shapes)};
    }
    for (const Instance& instance : scene_.instances)
      add_instance(use_of[instance.object].geometry, use_of[instance.object].user, instance.world_from_object);
  }

  void plan_chains() {
    std::vector<uint32_t> object_of(plan_.geometries.size(), baked::kNone); // of geometries in chains
    for (const LevelChain& chain : chains_) {
      baked::LevelChainRecord record{};
      record.level_count = static_cast<uint32_t>(chain.objects.size());
      double stretch = 0.0;
      for (size_t level = 0; level < chain.objects.size(); ++level) {
        const uint32_t g = record.geometry[level] = use_of_object_[chain.objects[level]].geometry;
        if (object_of[g] != baked::kNone) fail_chain(chain.objects[level], "is equal to " + name_of(object_of[g]));
        object_of[g] = chain.objects[level];
        if (plan_.geometries[g].slot_class.empty()) fail_chain(chain.objects[level], "has no triangles");
        if (plan_.geometries[g].slot_class != plan_.geometries[record.geometry[0]].slot_class)
          fail_chain(chain.objects[level], "has other materials than " + name_of(chain.objects[0]));
        stretch = std::max(stretch, plan_.geometries[g].max_stretch);
      }
      if (stretch == 0.0) fail_chain(chain.objects[0], "and the other levels of its chain have no instance");
      for (const uint32_t object : chain.objects)
        plan_.geometries[use_of_object_[object].geometry].max_stretch = stretch;
      std::ranges::copy(chain.distances, record.distance.begin());
      plan_.chains.push_back(record);
    }
  }

  std::string name_of(uint32_t object) const { return "\"" + scene_.objects[object].name + "\""; }

  [[noreturn]] void fail_chain(uint32_t object, const std::string& problem) const {
    throw Error(ErrorKind::kUsage, "levels by distance: object " + name_of(object) + " " + problem);
  }

  struct Use {
    uint32_t geometry = 0, user = 0;
  };

  const Scene& scene_;
  const std::span<const LevelChain> chains_;
  std::vector<uint8_t> deforms_; // per mesh
  std::vector<uint32_t> equal_mesh_;
  std::vector<Bounds> mesh_boxes_;
  std::vector<uint8_t> used_; // per object: it is instanced, or a level of a chain
  std::vector<Use> use_of_object_;
  std::vector<const InstanceMotion*> moving_;     // per instance; null: it does not move
  std::vector<GeometryUsers> users_;              // per geometry
  std::vector<uint32_t> user_of_;                 // per instance
  std::map<std::string, uint32_t> geometry_with_; // by content_key(): geometries that are not in world space
  ScenePlan plan_;
};

} // namespace

bool within_float_range(const Bounds& box) {
  constexpr double kMax = std::numeric_limits<float>::max();
  for (int axis = 0; axis < 3; ++axis)
    if (!(box.lo[axis] >= -kMax && box.hi[axis] <= kMax)) return false;
  return true;
}

std::string beyond_float_range(const std::string& name, const Bounds& box) {
  const DVec3 largest = glm::max(-box.lo, box.hi);
  return name + " leaves the float range: its coordinates reach " + brief(std::max({largest.x, largest.y, largest.z}));
}

ScenePlan plan_scene(const Scene& scene, std::span<const uint32_t> deforming, std::span<const LevelChain> chains) {
  return Planner(scene, deforming, chains).run();
}

} // namespace packtrace
