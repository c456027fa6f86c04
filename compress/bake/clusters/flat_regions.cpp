#include "compress/bake/clusters/flat_regions.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "compress/format/layout/baked_format.h"
#include "pbrt_import/base/disjoint_sets.h"
#include "pbrt_import/base/weld_table.h"

namespace packtrace {
namespace {

constexpr uint32_t kNoNormal = 0;    ///< Vertex::normal of a flat triangle's vertex
constexpr double kThinnerBits = 4.0; ///< saved per position in a cluster of flat triangles
constexpr double kClusterBits = 8.0 * (sizeof(baked::ClusterRecord) + 8); ///< of an additional cluster: record, padding

/// Use of a position or a vertex, as bits.
enum Use : uint8_t { kBySmooth = 1, kByFlat = 2 };

class FlatRegions {
public:
  FlatRegions(std::span<QuantizedPart> parts, const WeldedSurface& surface, const VertexBits& bits)
      : parts_(parts), surface_(surface), bits_(bits) {}

  void run() {
    if (!find_uses()) return;
    drop_useless_triangles();
    if (find_uses()) drop_regions();
  }

private:
  /// A distinct vertex at a position of a flat triangle. Corners of flat triangles have two vertices: one with their
  /// normal and one with kNoNormal.
  struct Vertex {
    uint32_t position;
    uint32_t normal; ///< 10 bits per axis, or kNoNormal
    UvLattice uv;
    uint8_t use;
  };

  /// Calls visit(part, triangle) for triangles of parts with normals that have not collapsed.
  template <typename Visit>
  void for_each_triangle(const Visit& visit) {
    for (QuantizedPart& part : parts_)
      for (size_t i = 0; i < part.triangles.size() && !part.normals.empty(); ++i)
        if (part.stays(i)) visit(part, i);
  }

  /// Numbers the vertices at positions of flat triangles. Returns whether there are both flat and smooth triangles.
  bool find_uses() {
    use_.assign(surface_.positions.size(), 0);
    uint8_t all = 0;
    size_t corners = 0;
    for_each_triangle([&](QuantizedPart& part, size_t i) {
      const uint8_t use = part.flat[i] != 0 ? kByFlat : kBySmooth;
      all |= use;
      corners += use == kByFlat ? 3 : 0;
      for (int k = 0; k < 3; ++k) use_[part.corners[i][k]] |= use;
    });
    if (all != (kBySmooth | kByFlat)) return false;
    vertices_.clear();
    for_each_triangle([&](QuantizedPart& part, size_t i) {
      if (part.flat[i] == 0)
        for (int k = 0; k < 3; ++k) corners += (use_[part.corners[i][k]] & kByFlat) != 0;
    });
    table_ = WeldTable(2 * corners);
    for_each_triangle([&](QuantizedPart& part, size_t i) {
      for (int k = 0; k < 3; ++k)
        if ((use_[part.corners[i][k]] & kByFlat) != 0) {
          vertices_[vertex(part, i, k)].use |= part.flat[i] != 0 ? kByFlat : kBySmooth;
          if (part.flat[i] != 0) vertices_[number({part.corners[i][k], kNoNormal, uv(part, i, k), 0})].use |= kByFlat;
        }
    });
    return true;
  }

  static UvLattice uv(const QuantizedPart& part, size_t i, int corner) {
    return part.uvs.empty() ? UvLattice{} : part.uvs[part.triangles[i][corner]];
  }

  /// Returns the vertex of a corner that is stored with its normal.
  uint32_t vertex(const QuantizedPart& part, size_t i, int corner) {
    const DVec3& n = part.normals[part.triangles[i][corner]];
    const auto component = [](double x) { return static_cast<uint32_t>(std::lround((x + 1.0) * 511.0)); };
    return number({part.corners[i][corner], 1 + (component(n.x) << 20 | component(n.y) << 10 | component(n.z)),
                   uv(part, i, corner), 0});
  }

  uint32_t number(const Vertex& v) {
    const uint64_t uv = static_cast<uint32_t>(v.uv[0]) | (uint64_t{static_cast<uint32_t>(v.uv[1])} << 32);
    const auto next = static_cast<uint32_t>(vertices_.size());
    const uint32_t found = table_.find_or_add(mix_words(v.position, v.normal, uv), next, [&](uint32_t other) {
      const Vertex& o = vertices_[other];
      return o.position == v.position && o.normal == v.normal && o.uv == v.uv;
    });
    if (found == next) vertices_.push_back(v);
    return found;
  }

  /// Marks flat triangles as smooth if smooth triangles use all their vertices, as they would save no normal.
  void drop_useless_triangles() {
    for_each_triangle([&](QuantizedPart& part, size_t i) {
      if (part.flat[i] == 0) return;
      bool saves = false;
      for (int k = 0; k < 3; ++k) saves |= vertices_[vertex(part, i, k)].use == kByFlat;
      if (!saves) part.flat[i] = 0;
    });
  }

  /// Joins the positions of each flat triangle.
  void find_regions() {
    regions_ = DisjointSets(surface_.positions.size());
    for_each_triangle([&](QuantizedPart& part, size_t i) {
      if (part.flat[i] == 0) return;
      for (int k = 1; k < 3; ++k) regions_.join(part.corners[i][0], part.corners[i][k]);
    });
  }

  /// Marks the triangles of regions that save no bits as smooth.
  void drop_regions() {
    find_regions();
    std::vector<double> saved(regions_.count()); // by the position that is the root of a region
    for (const Vertex& v : vertices_)
      if (v.use == kByFlat)
        saved[regions_.root(v.position)] +=
            v.normal != kNoNormal ? bits_.position + bits_.normal : kThinnerBits - bits_.position;
    double all = 0.0;
    for (const double bits : saved) all += std::max(bits, 0.0);
    const bool none = all < kClusterBits;
    for_each_triangle([&](QuantizedPart& part, size_t i) {
      if (part.flat[i] != 0 && (none || saved[regions_.root(part.corners[i][0])] <= 0.0)) part.flat[i] = 0;
    });
  }

  const std::span<QuantizedPart> parts_;
  const WeldedSurface& surface_;
  const VertexBits bits_;
  std::vector<uint8_t> use_;     // per position
  std::vector<Vertex> vertices_; // distinct
  WeldTable table_{1};
  DisjointSets regions_; // of positions
};

} // namespace

void choose_flat_regions(std::span<QuantizedPart> parts, const WeldedSurface& surface, const VertexBits& bits) {
  FlatRegions(parts, surface, bits).run();
}

} // namespace packtrace
