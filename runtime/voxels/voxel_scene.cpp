#include "runtime/voxels/voxel_scene.h"

#include <algorithm>
#include <cmath>

#include "compress/format/voxels/proxy_section.h"
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

} // namespace

VoxelScene::VoxelScene(const BakedFile& file, const std::function<bool(uint32_t)>& wanted) {
  if (const std::span<const uint8_t> bytes = proxy_bytes(file); !bytes.empty()) proxies_ = read_proxies(bytes);
  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> proxy_of(file.geometries().size(), kNone);
  for (size_t i = 0; i < proxies_.size(); ++i) proxy_of[proxies_[i].record.geometry] = static_cast<uint32_t>(i);
  std::vector<Bounds> boxes;
  for (uint32_t i = 0; i < file.instances().size(); ++i) {
    const uint32_t number = proxy_of[file.instances()[i].geometry];
    if (number == kNone) {
      ++without_;
      continue;
    }
    if (wanted && !wanted(i)) continue;
    const VoxelFrame frame = proxies_[number].frame();
    const DAffine world_from_grid = compose(DAffine(file.world_from_object(i)), grid_placement(frame));
    const DAffine grid_from_world = inverse(world_from_grid);
    if (!is_finite(grid_from_world[0]) || !is_finite(grid_from_world[1]) || !is_finite(grid_from_world[2]) ||
        !is_finite(grid_from_world[3])) {
      ++flat_;
      continue;
    }
    Bounds box;
    for (int c = 0; c < 8; ++c)
      box.extend(transform_point(
          world_from_grid, DVec3((c & 1) * frame.size[0], (c >> 1 & 1) * frame.size[1], (c >> 2) * frame.size[2])));
    boxes.push_back(box);
    placed_.push_back({i, number, grid_from_world, normal_matrix(world_from_grid)});
  }
  tree_ = ThingTree(std::move(boxes));
}

std::optional<SceneVoxelHit> VoxelScene::first_hit(DVec3 origin, DVec3 direction, double t_min, double t_max) const {
  std::optional<VoxelHit<double>> best;
  const Placed* from = nullptr;
  tree_.visit(origin, direction, t_min, t_max, [&](uint32_t thing, double limit) {
    const Placed& placed = placed_[thing];
    const auto hit = VoxelTracer(proxies_[placed.proxy].voxels)
                         .first_hit(transform_point(placed.grid_from_world, origin),
                                    transform_vector(placed.grid_from_world, direction), t_min, limit);
    if (!hit || (best && !(hit->t < best->t || (hit->t == best->t && placed.instance < from->instance)))) return limit;
    best = hit, from = &placed;
    return hit->t > t_min ? std::nextafter(hit->t, limit + 1.0) : hit->t;
  });
  if (!best) return std::nullopt;
  SceneVoxelHit result;
  result.t = best->t, result.instance = from->instance, result.voxel = best->voxel;
  const Proxy& proxy = proxies_[from->proxy];
  DVec3 normal(0.0);
  normal[std::max(best->axis, 0)] =
      transform_vector(from->grid_from_world, direction)[std::max(best->axis, 0)] > 0.0 ? -1.0 : 1.0;
  result.normal = glm::normalize(from->world_normal * normal);
  result.edge = 1.0 / glm::length(glm::transpose(glm::dmat3(from->grid_from_world)) * normal);
  if (!proxy.palette.empty()) result.albedo = linear_color(proxy.palette[proxy.voxels.swatch(best->voxel)]);
  return result;
}

bool VoxelScene::occluded(DVec3 origin, DVec3 direction, double t_min, double t_max) const {
  bool hit = false;
  tree_.visit(origin, direction, t_min, t_max, [&](uint32_t thing, double limit) {
    const Placed& placed = placed_[thing];
    hit = VoxelTracer(proxies_[placed.proxy].voxels)
              .occluded(transform_point(placed.grid_from_world, origin),
                        transform_vector(placed.grid_from_world, direction), t_min, limit);
    return hit ? t_min : limit;
  });
  return hit;
}

double VoxelScene::first_distance(DVec3 origin, DVec3 direction, double t_min, double t_max) const {
  constexpr double kDiagonal = 1.7320508075688772, kMargin = 1.0; // voxels
  double nearest = t_max;
  tree_.visit(origin, direction, t_min, t_max, [&](uint32_t thing, double limit) {
    const Placed& placed = placed_[thing];
    const OccupancyStream& stream = proxies_[placed.proxy].voxels;
    const DVec3 o = transform_point(placed.grid_from_world, origin),
                d = transform_vector(placed.grid_from_world, direction);
    bool inside = true;
    for (int a = 0; a < 3; ++a) inside &= o[a] > -kMargin && o[a] < stream.size()[static_cast<size_t>(a)] + kMargin;
    const double begin = inside ? std::max(t_min, kDiagonal / glm::length(d)) : t_min;
    if (!(begin < limit)) return limit;
    if (const auto hit = VoxelTracer(stream).first_hit(o, d, begin, limit)) nearest = hit->t;
    return nearest;
  });
  return nearest;
}

uint64_t VoxelScene::resident_bytes() const {
  uint64_t bytes = placed_.size() * sizeof(Placed) + tree_.bytes();
  for (const Proxy& proxy : proxies_) bytes += sizeof(Proxy) + 4 * (proxy.voxels.words().size() + proxy.palette.size());
  return bytes;
}

} // namespace packtrace
