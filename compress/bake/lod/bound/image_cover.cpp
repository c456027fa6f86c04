#include "compress/bake/lod/bound/image_cover.h"

#include <algorithm>

namespace packtrace {
namespace {

constexpr uint8_t kCrossed = 8;

} // namespace

void ImageCover::begin(std::span<const uint8_t> mapped) {
  const size_t count = mesh_.triangles.size();
  borders_.assign(count, 0);
  is_seed_.assign(count, 0);
  shares_.assign(count, 0.0);
  part_.assign(count, kNone);
  seeds_.clear();
  mark_borders(mapped);
  for (uint32_t s = 0; s < count; ++s)
    if (part_[s] == kNone && (borders_[s] & kCrossed) == 0) find_part(s);
}

void ImageCover::add(uint32_t triangle, const TriangleImages::Image& image) {
  const auto met = images_.met(image);
  if (std::any_of(met.begin(), met.end(), [&](uint32_t s) { return is_seed_[s] != 0; }))
    images_.add_shares(triangle, image, is_seed_, shares_);
}

/// Marks the triangles that borders of the mapped images cross, and the sides that they run along.
void ImageCover::mark_borders(std::span<const uint8_t> mapped) {
  using EdgePath = SurfaceWalk::EdgePath;
  const std::span<const EdgePath> ways = walk_.ways();
  std::vector<int32_t> balance(ways.size());
  for (uint32_t t = 0; 3 * size_t{t} < mesh_.side_edges.size(); ++t) {
    if (mapped[t] == 0) continue;
    const Triangle& p = walk_.source().triangles[t].points;
    const uint32_t* edge = &mesh_.side_edges[3 * size_t{t}];
    balance[edge[0]] += p.x < p.y ? 1 : -1;
    balance[edge[1]] += p.y < p.z ? 1 : -1;
    balance[edge[2]] += p.z < p.x ? 1 : -1;
  }
  for (uint32_t e = 0; e < ways.size(); ++e) {
    const EdgePath& w = ways[e];
    if (balance[e] == 0) continue;
    if (w.state == EdgePath::State::kAcross) {
      borders_[w.start] |= kCrossed;
      for (uint32_t k = w.first; k < w.first + w.count; ++k) borders_[walk_.into(k)] |= kCrossed;
    } else if (const uint32_t side = walk_.side_along(e); side != kNone) {
      for (const uint32_t corner : {side, walk_.opposite(side)})
        if (corner != kNone) borders_[corner / 4] |= static_cast<uint8_t>(1u << (corner % 4));
    }
  }
}

/// Collects all triangles that can be reached from `first` without crossing a border.
void ImageCover::find_part(uint32_t first) {
  const auto number = static_cast<uint32_t>(seeds_.size());
  reached_.assign(1, first);
  part_[first] = number;
  uint32_t seed = first;
  double largest = -1.0;
  for (size_t i = 0; i < reached_.size(); ++i) {
    const uint32_t s = reached_[i];
    const DVec3& normal = walk_.area_normal(s);
    if (const double area2 = glm::dot(normal, normal); area2 > largest) largest = area2, seed = s;
    for (uint32_t side = 0; side < 3; ++side) {
      if ((borders_[s] >> side & 1) != 0) continue;
      const uint32_t next = walk_.beyond(4 * s + side);
      if (next != kNone && part_[next] == kNone && (borders_[next] & kCrossed) == 0)
        part_[next] = number, reached_.push_back(next);
    }
  }
  seeds_.push_back(seed);
  is_seed_[seed] = 1;
}

} // namespace packtrace
