#include "compress/bake/lod/bound/line_cover.h"

#include <algorithm>

namespace packtrace {
namespace {

using Side = std::pair<uint32_t, uint32_t>;

Side side(uint32_t a, uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

bool is_line(const Triangle& t) { return t.x == t.y || t.y == t.z || t.z == t.x; }

/// The ends of the segment; equal if all corners coincide.
Side ends(const Triangle& line) { return line.x == line.y ? side(line.y, line.z) : side(line.x, line.y); }

} // namespace

LineCover::LineCover(std::span<const Triangle> triangles, std::span<const QuantizedVertex> vertices,
                     size_t position_count) {
  const auto points_of = [&](const Triangle& t) {
    return Triangle(vertices[t.x].position, vertices[t.y].position, vertices[t.z].position);
  };
  std::vector<Side> lines;
  for (const Triangle& t : triangles)
    if (const Triangle p = points_of(t); is_line(p)) lines.push_back(ends(p));
  if (lines.empty()) return;
  std::sort(lines.begin(), lines.end());
  lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
  std::vector<uint8_t> is_end(position_count);
  for (const Side& line : lines) is_end[line.first] = is_end[line.second] = 1;
  const auto add = [&](uint32_t a, uint32_t b) {
    if (is_end[a] != 0 && is_end[b] != 0 && std::binary_search(lines.begin(), lines.end(), side(a, b)))
      sides_.push_back(side(a, b));
  };
  for (const Triangle& t : triangles) {
    const Triangle p = points_of(t);
    if (is_line(p)) continue;
    for (int i = 0; i < 3; ++i) add(p[i], p[(i + 1) % 3]), add(p[i], p[i]);
  }
  std::sort(sides_.begin(), sides_.end());
  sides_.erase(std::unique(sides_.begin(), sides_.end()), sides_.end());
}

bool LineCover::holds(const Triangle& line) const {
  return std::binary_search(sides_.begin(), sides_.end(), ends(line));
}

} // namespace packtrace
