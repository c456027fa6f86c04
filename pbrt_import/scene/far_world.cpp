#include "pbrt_import/scene/far_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "pbrt_import/scene/shape_bounds.h"

namespace packtrace {
namespace {

/// Distances from zero, in diagonals of the bounds, beyond which the world and objects are moved. At these distances,
/// half the spacing of floats is up to 2^-16 diagonals of the world, and 2^-12 of an object, which is small in the
/// picture.
constexpr double kFarWorld = 256.0, kFarObject = 4096.0;

/// By absolute value.
double largest_coordinate(const Bounds& box) {
  const DVec3 far = glm::max(glm::abs(box.lo), glm::abs(box.hi));
  return std::max({far.x, far.y, far.z});
}

/// Returns the point near a box's centre that becomes the new zero; 0 if the box lies within `limit` of its diagonals
/// from zero.
DVec3 new_zero(const Bounds& box, double limit) {
  if (box.empty()) return DVec3(0.0);
  const double distance = largest_coordinate(box), diagonal = box.diagonal();
  if (!std::isfinite(distance) || !(distance > limit * diagonal)) return DVec3(0.0);
  // A multiple of a power of two has few bits, so subtracting it is exact. Without an extent, the zero is the box's
  // centre.
  const double unit = diagonal > 0.0 ? std::ldexp(1.0, std::ilogb(diagonal)) : 0.0;
  const DVec3 centre = box.lo * 0.5 + box.hi * 0.5; // lo + hi may overflow
  if (!(unit > distance * 0x1p-50)) return centre;
  const DVec3 zero = glm::round(centre / unit) * unit;
  return packtrace::is_finite(zero) ? zero : DVec3(0.0);
}

DAffine moved(DAffine map, DVec3 by) {
  map[3] += by;
  return map;
}

using AddResidual = std::function<void(size_t instance, DAffine& map)>;

/// Bounds of the translations of all instances, and of the distance between an instance's translation and its points.
struct Spread {
  Bounds translations;
  double radius = 0.0; ///< largest distance along an axis
};

/// @param object_radius largest coordinate, by absolute value, of a point of an object in its own space
Spread spread_of(std::span<const Instance> instances, double object_radius) {
  Vec3 lo(std::numeric_limits<float>::infinity()), hi = -lo, largest(0.0f);
  for (const Instance& instance : instances) {
    const Affine& map = instance.world_from_object;
    lo = glm::min(lo, map[3]), hi = glm::max(hi, map[3]);
    largest = glm::max(largest, glm::max(glm::max(glm::abs(map[0]), glm::abs(map[1])), glm::abs(map[2])));
  }
  const double factor = double{std::max({largest.x, largest.y, largest.z})};
  return {{DVec3(lo), DVec3(hi)}, 3.0 * factor * object_radius};
}

class Mover {
public:
  Mover(Scene& scene, const AddResidual& add_residual) : scene_(scene), add_residual_(add_residual) {}

  void run() {
    if (!scene_.objects.empty() || scene_.shapes.size() > scene_.meshes.size()) find_mesh_boxes();
    objects_moved_ = move_objects();
    if (!objects_moved_ && surely_near()) return;
    if (meshes_.empty()) find_mesh_boxes();
    Bounds world = bounds_of_shapes(scene_.shapes, meshes_);
    for (size_t i = 0; i < scene_.instances.size(); ++i)
      world.extend(transform_bounds(map(i), object_boxes_[scene_.instances[i].object]));
    const DVec3 origin = new_zero(world, kFarWorld);
    if (origin != DVec3(0.0)) move_world(origin);
    if (!objects_moved_ && origin == DVec3(0.0)) return; // every bit stays as it was
    for (size_t i = 0; i < scene_.instances.size(); ++i)
      scene_.instances[i].world_from_object = Affine(moved(map(i), -origin));
  }

private:
  void find_mesh_boxes() {
    meshes_.reserve(scene_.meshes.size());
    for (const Mesh& mesh : scene_.meshes) meshes_.push_back(bounds_of(mesh.positions));
  }

  /// A fast sufficient test: if it is true, the world need not be moved. It bounds all instances together, because
  /// computing the boxes of a million instances takes longer than reading them.
  bool surely_near() const {
    double object_radius = 0.0;
    for (const Bounds& box : object_boxes_) {
      if (box.empty()) return false;
      object_radius = std::max(object_radius, largest_coordinate(box));
    }
    Bounds shapes;
    for (const Shape& shape : scene_.shapes) {
      const DAffine& map = shape.parent_from_mesh;
      // run() has computed the boxes of all meshes if several shapes may use one.
      const Bounds box = meshes_.empty() ? bounds_of(scene_.meshes[shape.mesh].positions) : meshes_[shape.mesh];
      const bool moves_only = glm::dmat3(map) == glm::dmat3(1.0); // then corners need no products
      shapes.extend(moves_only ? Bounds{box.lo + map[3], box.hi + map[3]} : transform_bounds(map, box));
    }
    double distance = shapes.empty() ? 0.0 : largest_coordinate(shapes), diagonal = shapes.diagonal();
    if (!scene_.instances.empty()) {
      const Spread spread = spread_of(scene_.instances, object_radius);
      distance = std::max(distance, largest_coordinate(spread.translations) + spread.radius);
      const DVec3 surely = glm::max(spread.translations.extent() - DVec3(2.0 * spread.radius), DVec3(0.0));
      diagonal = std::max(diagonal, glm::length(surely));
    }
    constexpr double kMargin = 0.75; // for all rounding
    return std::isfinite(distance) && distance < kMargin * kFarWorld * diagonal;
  }

  /// world_from_object of an instance in doubles, after its object's shapes have moved. Computed when it is needed,
  /// because an array of all maps takes more memory than the instances.
  DAffine map(size_t i) const {
    const Instance& instance = scene_.instances[i];
    DAffine map(instance.world_from_object);
    if (add_residual_) add_residual_(i, map);
    if (objects_moved_) map[3] = transform_point(map, zeros_[instance.object]);
    return map;
  }

  bool move_objects() {
    zeros_.assign(scene_.objects.size(), DVec3(0.0));
    for (size_t i = 0; i < zeros_.size(); ++i) {
      object_boxes_.push_back(bounds_of_shapes(scene_.objects[i].shapes, meshes_));
      zeros_[i] = new_zero(object_boxes_[i], kFarObject);
    }
    for (const AnimatedInstance& animated : scene_.animated_instances)
      zeros_[scene_.instances[animated.instance].object] = DVec3(0.0);
    for (const InstanceMotion& moving : scene_.motion.instances)
      zeros_[scene_.instances[moving.instance - scene_.shapes.size()].object] = DVec3(0.0);
    bool any = false;
    for (size_t i = 0; i < zeros_.size(); ++i) {
      if (zeros_[i] == DVec3(0.0)) continue;
      any = true;
      move_shapes(scene_.objects[i].shapes, zeros_[i]);
      object_boxes_[i].lo -= zeros_[i], object_boxes_[i].hi -= zeros_[i];
    }
    return any;
  }

  void move_world(DVec3 origin) {
    scene_.origin = origin;
    move_shapes(scene_.shapes, origin);
    for (AnimatedInstance& animated : scene_.animated_instances) move_animation(animated.animation, origin);
    move_tracks(origin);
    for (Camera& camera : scene_.cameras) {
      camera.world_from_camera = moved(camera.world_from_camera, -origin);
      move_animation(camera.animation, origin);
    }
    for (Light& light : scene_.lights) light.position -= origin;
  }

  /// Moves the tracks that lead to the world.
  void move_tracks(DVec3 origin) {
    std::vector<bool> outer(scene_.motion.tracks.size(), false);
    for (const InstanceMotion& moving : scene_.motion.instances) outer[moving.track] = true;
    for (const CameraMotion& moving : scene_.motion.cameras) outer[moving.track] = true;
    for (size_t i = 0; i < outer.size(); ++i)
      if (outer[i])
        for (MotionKey& key : scene_.motion.tracks[i].keys) key.translation -= origin;
  }

  void move_shapes(std::vector<Shape>& shapes, DVec3 zero) {
    for (Shape& shape : shapes) {
      shape.parent_from_mesh = moved(shape.parent_from_mesh, -zero);
      move_animation(shape.animation, zero);
    }
  }

  /// Points to a moved copy of the animation, because others may share the original.
  void move_animation(uint32_t& animation, DVec3 zero) {
    if (animation == kNotAnimated) return;
    const auto key = std::pair(animation, std::array{zero.x, zero.y, zero.z});
    const auto [found, inserted] = animations_.try_emplace(key, static_cast<uint32_t>(scene_.animations.size()));
    if (inserted) {
      AnimatedTransform copy = scene_.animations[animation];
      copy.start.map = moved(copy.start.map, -zero);
      copy.end.map = moved(copy.end.map, -zero);
      scene_.animations.push_back(copy);
    }
    animation = found->second;
  }

  Scene& scene_;
  const AddResidual& add_residual_; ///< as in move_far_world()
  std::vector<Bounds> meshes_;      ///< empty until they are needed
  std::vector<Bounds> object_boxes_;
  std::vector<DVec3> zeros_;   ///< by object: the point that becomes its zero
  bool objects_moved_ = false; ///< whether a zero differs from 0; then map() applies them
  std::map<std::pair<uint32_t, std::array<double, 3>>, uint32_t> animations_;
};

} // namespace

void move_far_world(Scene& scene, const AddResidual& add_residual) { Mover(scene, add_residual).run(); }

} // namespace packtrace
