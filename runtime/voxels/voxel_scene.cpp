#include "runtime/voxels/voxel_scene.h"

#include <algorithm>
#include <cmath>

#include "compress/format/voxels/proxy_section.h"
#include "pbrt_import/scene/flattening.h"
#include "runtime/voxels/field_tracer.h"
#include "runtime/voxels/proxy_reach.h"
#include "runtime/voxels/voxel_tracer.h"

namespace packtrace {
namespace {

Vec3 linear_color(uint32_t srgb) {
  const auto linear = [](uint32_t byte) {
    const double c = static_cast<double>(byte) / 255.0;
    return static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
  };
  return {linear(srgb & 0xffu), linear(srgb >> 8 & 0xffu), linear(srgb >> 16 & 0xffu)};
}

/// Object space from voxel units.
DAffine grid_placement(const VoxelFrame& frame) {
  return DAffine(DVec3(frame.edge, 0, 0), DVec3(0, frame.edge, 0), DVec3(0, 0, frame.edge), frame.origin);
}

/// A hit in the units of a proxy's grid.
struct ProxyHit {
  double t;
  VoxelIndex voxel{};
  DVec3 normal; ///< towards the ray's origin
};

/// Where a ray in the grid space of a proxy may begin to hit.
struct RayStart {
  double t;                ///< smallest ray parameter of a hit
  bool from_empty = false; ///< ignore voxels before the first empty one (VoxelTracer::first_hit_from_empty)
};

/// How far outside a proxy's surface rays start that leave it, in voxels. Unsigned distances do not lead out of the
/// surface before about 1.5 voxels, 0.6 of which lie between the source and the surface that rays meet.
double clearance_of(const Proxy& proxy) {
  if (!proxy.is_field()) return 1e-3;
  return (proxy.record.flags & voxels::kSigned) != 0 ? 0.3 : 0.9;
}

std::optional<ProxyHit> hit_of(const Proxy& proxy, DVec3 origin, DVec3 direction, RayStart start, double t_max) {
  if (proxy.is_field()) {
    const double length = glm::length(direction);
    const FieldTracer tracer(proxy.field, (proxy.record.flags & voxels::kSigned) != 0);
    const auto hit = tracer.first_hit(origin, direction / length, start.t * length, t_max * length);
    if (!hit) return std::nullopt;
    const double t = hit->t / length;
    if (!(t < t_max)) return std::nullopt;
    return ProxyHit{t, {}, DVec3(hit->normal)};
  }
  const VoxelTracer tracer(proxy.voxels);
  const auto hit = start.from_empty ? tracer.first_hit_from_empty(origin, direction, start.t, t_max)
                                    : tracer.first_hit(origin, direction, start.t, t_max);
  if (!hit) return std::nullopt;
  DVec3 normal(0.0);
  const int axis = std::max(hit->axis, 0);
  normal[axis] = direction[axis] > 0.0 ? -1.0 : 1.0;
  return ProxyHit{hit->t, hit->voxel, normal};
}

} // namespace

bool flattens(const DAffine& world_from_object, const Bounds& object, const Bounds& world) {
  return flattens(world_from_object) ||
         !(transform_bounds(world_from_object, object).diagonal() > 0x1p-24 * world.diagonal());
}

VoxelScene::VoxelScene(const BakedFile& file, const std::function<bool(uint32_t)>& wanted) {
  if (const std::span<const uint8_t> bytes = proxy_bytes(file); !bytes.empty()) proxies_ = read_proxies(bytes);
  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> proxy_of(file.geometries().size(), kNone);
  for (size_t i = 0; i < proxies_.size(); ++i) proxy_of[proxies_[i].record.geometry] = static_cast<uint32_t>(i);
  std::vector<ProxyReach> reaches;
  for (const Proxy& proxy : proxies_) reaches.emplace_back(proxy);
  std::vector<Bounds> boxes;
  for (uint32_t i = 0; i < file.instances().size(); ++i) {
    const uint32_t number = proxy_of[file.instances()[i].geometry];
    if (number == kNone) {
      ++without_;
      continue;
    }
    if (wanted && !wanted(i)) continue;
    const DAffine world_from_object(file.world_from_object(i));
    if (flattens(world_from_object, object_bounds(file.geometries()[file.instances()[i].geometry]),
                 file.world_bounds())) {
      ++flat_;
      continue;
    }
    const VoxelFrame frame = proxies_[number].frame();
    const DAffine world_from_grid = compose(world_from_object, grid_placement(frame));
    boxes.push_back(reaches[number].bounds(world_from_grid));
    placed_.push_back({i, number, inverse(world_from_grid), normal_matrix(world_from_grid)});
  }
  tree_ = ThingTree(boxes);
}

template <class Begin, class Found>
void VoxelScene::search(DVec3 origin, DVec3 direction, double t_min, double t_max, const Begin& begin,
                        const Found& found) const {
  tree_.visit(origin, direction, t_min, t_max, [&](uint32_t thing, double limit) {
    const Placed& placed = placed_[thing];
    const Proxy& proxy = proxies_[placed.proxy];
    DVec3 o = transform_point(placed.grid_from_world, origin);
    const DVec3 d = transform_vector(placed.grid_from_world, direction);
    const RayStart start = begin(thing, o, d);
    if (!(start.t < limit)) return limit;
    const auto hit = hit_of(proxy, o, d, start, limit);
    return hit ? found(thing, *hit, limit) : limit;
  });
}

std::optional<SceneVoxelHit> VoxelScene::first_hit(DVec3 origin, DVec3 direction, double t_min, double t_max) const {
  std::optional<ProxyHit> best;
  uint32_t best_thing = 0;
  search(
      origin, direction, t_min, t_max, [&](uint32_t, DVec3&, DVec3) { return RayStart{t_min}; },
      [&](uint32_t thing, const ProxyHit& hit, double limit) {
        if (best && !(hit.t < best->t || (hit.t == best->t && thing < best_thing))) return limit;
        best = hit, best_thing = thing;
        return hit.t > t_min ? std::nextafter(hit.t, limit + 1.0) : hit.t; // of equal ones the first instance counts
      });
  if (!best) return std::nullopt;
  const Placed& from = placed_[best_thing];
  const Proxy& proxy = proxies_[from.proxy];
  SceneVoxelHit result;
  result.t = best->t, result.instance = from.instance, result.voxel = best->voxel, result.placed = best_thing;
  result.clearance = glm::inverse(glm::dmat3(from.grid_from_world)) * (clearance_of(proxy) * best->normal);
  result.normal = glm::normalize(from.world_normal * best->normal);
  result.edge = 1.0 / glm::length(glm::transpose(glm::dmat3(from.grid_from_world)) * best->normal);
  if (!proxy.palette.empty()) result.albedo = linear_color(proxy.palette[proxy.voxels.swatch(best->voxel)]);
  return result;
}

std::optional<FieldVisibility> VoxelScene::field_visibility(const SceneVoxelHit& hit, DVec3 point,
                                                            double radius) const {
  const Placed& placed = placed_[hit.placed];
  const Proxy& proxy = proxies_[placed.proxy];
  if (!proxy.is_field()) return std::nullopt;
  const FieldTracer tracer(proxy.field, (proxy.record.flags & voxels::kSigned) != 0);
  const glm::vec3 p(transform_point(placed.grid_from_world, point));
  // The normal of the grid is the world's under the transposed map.
  const glm::vec3 normal(glm::normalize(glm::transpose(glm::inverse(glm::dmat3(placed.grid_from_world))) * hit.normal));
  const auto reach = static_cast<float>(radius / hit.edge);
  return FieldVisibility{tracer.tap_visibility(p, normal, reach), tracer.cone_visibility(p, normal, reach)};
}

bool VoxelScene::occluded(DVec3 origin, DVec3 direction, double t_min, double t_max) const {
  bool hit = false;
  search(
      origin, direction, t_min, t_max, [&](uint32_t, DVec3&, DVec3) { return RayStart{t_min}; },
      [&](uint32_t, const ProxyHit&, double) {
        hit = true;
        return t_min;
      });
  return hit;
}

bool VoxelScene::occluded_from(const SceneVoxelHit& hit, DVec3 point, DVec3 direction, double t_max) const {
  const auto begin = [&](uint32_t thing, DVec3& o, DVec3) {
    DVec3 way = transform_vector(placed_[thing].grid_from_world, hit.clearance);
    if (thing != hit.placed) way *= std::min(1.0, clearance_of(proxies_[placed_[thing].proxy]) / glm::length(way));
    o += way;
    return RayStart{0.0};
  };
  bool occluded = false;
  search(point, direction, 0.0, t_max, begin, [&](uint32_t, const ProxyHit&, double) {
    occluded = true;
    return 0.0;
  });
  return occluded;
}

double VoxelScene::first_distance(DVec3 origin, DVec3 direction, double t_min, double t_max) const {
  constexpr double kDiagonal = 1.7320508075688772, kMargin = 1.0; // voxels
  const auto begin = [&](uint32_t thing, DVec3& o, DVec3 d) {
    const VoxelIndex size = proxies_[placed_[thing].proxy].frame().size;
    bool inside = true;
    for (int a = 0; a < 3; ++a) inside &= o[a] > -kMargin && o[a] < size[static_cast<size_t>(a)] + kMargin;
    return inside ? RayStart{std::max(t_min, kDiagonal / glm::length(d)), true} : RayStart{t_min};
  };
  double nearest = t_max;
  search(origin, direction, t_min, t_max, begin,
         [&](uint32_t, const ProxyHit& hit, double) { return nearest = hit.t; });
  return nearest;
}

uint64_t VoxelScene::resident_bytes() const {
  uint64_t bytes = placed_.size() * sizeof(Placed) + tree_.bytes();
  for (const Proxy& proxy : proxies_)
    bytes += sizeof(Proxy) + 4 * (proxy.voxels.words().size() + proxy.field.words().size() + proxy.palette.size());
  return bytes;
}

} // namespace packtrace
