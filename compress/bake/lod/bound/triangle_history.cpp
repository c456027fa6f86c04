#include "compress/bake/lod/bound/triangle_history.h"

namespace packtrace {

void TriangleHistory::begin_level() {
  if (levels_.size() == kDepth) levels_.erase(levels_.begin());
  levels_.push_back({next_triangle_, {}, {}});
}

void TriangleHistory::append(std::span<const uint32_t> ends, std::span<const uint32_t> below) {
  Level& level = levels_.back();
  const auto source = static_cast<uint32_t>(level.below.size());
  for (const uint32_t end : ends) level.ends.push_back(source + end);
  level.below.insert(level.below.end(), below.begin(), below.end());
  next_triangle_ += static_cast<uint32_t>(ends.size());
}

std::span<const uint32_t> TriangleHistory::below(uint32_t triangle) const {
  for (const Level& level : levels_) {
    if (triangle < level.first_triangle || triangle - level.first_triangle >= level.ends.size()) continue;
    const uint32_t i = triangle - level.first_triangle, begin = i == 0 ? 0 : level.ends[i - 1];
    return std::span(level.below).subspan(begin, level.ends[i] - begin);
  }
  return {};
}

} // namespace packtrace
