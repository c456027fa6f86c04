#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/grid/welded_surface.h"
#include "pbrt_import/base/weld_table.h"

namespace packtrace {

/// Finds triangles that quantisation made equal to an earlier one: same vertices, kind and winding, but different in
/// the source. Duplicates in the source are kept. Triangles of opposite winding are kept too, because a thin sheet is
/// watertight only with both of its sides.
class CoincidingTriangles {
public:
  /// Source of a triangle.
  struct Source {
    uint32_t part = 0;
    Triangle vertices{}; ///< vertex numbers in the part's mesh, by corner
  };

  /// @param capacity maximum number of triangles
  CoincidingTriangles(const SourcePoints& source, size_t capacity) : source_(source), table_(capacity) {}

  /// Returns whether the triangle repeats an earlier one. If its vertices are new, remembers it for later comparisons.
  /// @param vertices vertex numbers after quantisation
  bool repeats(const Triangle& vertices, uint32_t kind, const Source& from) {
    const int first = vertices.x <= vertices.y && vertices.x <= vertices.z ? 0 : vertices.y <= vertices.z ? 1 : 2;
    const Known known{turned(vertices, first), kind, {from.part, turned(from.vertices, first)}};
    const uint64_t hash = mix_words(known.vertices.x | (uint64_t{known.vertices.y} << 32), known.vertices.z, kind);
    const auto next = static_cast<uint32_t>(known_.size());
    const uint32_t number = table_.find_or_add(hash, next, [&](uint32_t other) {
      return known_[other].vertices == known.vertices && known_[other].kind == kind;
    });
    if (number == next) return known_.push_back(known), false;
    const Source& earlier = known_[number].source;
    for (int i = 0; i < 3; ++i)
      if (!source_.same(earlier.part, earlier.vertices[i], from.part, known.source.vertices[i])) return true;
    return false;
  }

private:
  struct Known {
    Triangle vertices;
    uint32_t kind;
    Source source;
  };

  static Triangle turned(const Triangle& t, int first) { return {t[first], t[(first + 1) % 3], t[(first + 2) % 3]}; }

  const SourcePoints& source_;
  WeldTable table_;
  std::vector<Known> known_;
};

} // namespace packtrace
