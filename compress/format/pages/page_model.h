#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "compress/format/pages/normal_predictor.h"
#include "compress/format/pages/page_cluster.h"
#include "compress/format/pages/page_contexts.h"
#include "compress/format/pages/page_surface.h"

namespace packtrace {

/// Codes the values of a page's clusters: their order, and the prediction of each value. The same code encodes and
/// decodes. A coder's functions take the value and return it; decoders ignore the argument.
///
/// A Coder has:
///   static constexpr bool kDecodes;
///   uint32_t symbol(uint32_t context, uint32_t value);              values 0..15
///   uint32_t symbol(uint32_t first, uint32_t second, uint32_t value);   with the mean of two models
///   uint64_t raw(uint32_t context, uint64_t value, uint32_t bits);  0..32 bits; the context only assigns a stream
///   uint32_t find_point(const LatticePoint&);                       encoders: the page's point there, or kNoPoint
///   void add_point(const LatticePoint&, uint32_t point);            encoders
/// Decoded values stay within the arrays that they index, for any bytes; fault() reports invalid data.
template <class Coder>
class PageModel : public PageSurface<Coder> {
public:
  using PageSurface<Coder>::PageSurface;

  /// Call before the first cluster of each page.
  void begin() {
    this->begin_surface();
    last_ = {};
    normals_.begin();
    normals_at_.clear();
  }

  /// Codes one cluster.
  /// @param values input of encoders, output of decoders
  void code_cluster(const baked::GeometryRecord& geometry, ClusterValues& values) {
    encoding_ = static_cast<NormalEncoding>(geometry.normal_encoding);
    code_header(values);
    this->code_triangles(values);
    if (values.has_normals && !fault_) code_normals();
    if (values.has_uvs && !fault_) code_uvs();
    last_.material = values.material;
    last_.has_normals = values.has_normals, last_.has_uvs = values.has_uvs;
  }

private:
  using Surface = PageSurface<Coder>;
  using Surface::coder_, Surface::fault_, Surface::kDecodes, Surface::kNone, Surface::kNoVertex;
  using Surface::corners_of_, Surface::points_, Surface::values_, Surface::vertex_count_, Surface::vertices_;
  using Surface::difference, Surface::flag;
  using Vertex = typename Surface::Vertex;

  void code_header(ClusterValues& c) {
    if (flag(context::kSameMaterial, c.material == last_.material) != 0)
      c.material = last_.material;
    else
      c.material = static_cast<uint32_t>(coder_.raw(context::kSameMaterial, c.material, 32));
    c.has_normals = flag(context::kHasNormals + (last_.has_normals ? 1 : 0), c.has_normals) != 0;
    c.has_uvs = flag(context::kHasUvs + (last_.has_uvs ? 1 : 0), c.has_uvs) != 0;
    if (c.has_normals) {
      c.normal_chart = coder_.symbol(context::kNormalChart, c.normal_chart);
      c.normal_palette = flag(context::kNormalPalette, c.normal_palette) != 0;
    }
  }

  void code_normals() {
    ClusterValues& c = *values_;
    sum_face_normals();
    normals_at_.resize(points_.size());
    uint32_t last = 0;
    for (uint32_t v = 0; v < vertex_count_; ++v) {
      PagePointNormals& point = normals_at_[vertices_[v].point];
      std::array<const NormalFields*, 4> candidates{};
      uint32_t count = 0, known = 0;
      const auto offer = [&](const NormalFields& fields) {
        for (uint32_t i = 0; i < count; ++i)
          if (*candidates[i] == fields) return;
        candidates[count++] = &fields;
      };
      for (uint32_t i = 0; i < point.count; ++i) offer(point.last[i]);
      known = count;
      for (const uint16_t n : vertices_[v].neighbours)
        if (n != kNoVertex) offer(c.normals[n]);
      NormalFields fields = c.normals[v];
      uint32_t choice = count;
      if constexpr (!kDecodes) {
        for (choice = 0; choice < count && !(*candidates[choice] == fields);) ++choice;
        choice = choice == count ? 0 : choice + 1;
      }
      choice = coder_.symbol(context::kNormalChoice + (last * 3 + known) * 3 + count - known, choice);
      last = std::min(choice > known ? 2u : choice, 2u);
      if (choice > count) {
        fault_ = true;
        return;
      }
      c.normals[v] =
          choice > 0 ? *candidates[choice - 1] : code_normal(fields, normals_.predict(encoding_, surroundings(v)));
      vertices_[v].unit_normal = decode_normal(encoding_, c.normals[v]);
      if (choice == 0) normals_.learn(DVec3(vertices_[v].unit_normal));
      if (choice == 0 || choice > known || choice == 2) {
        point.last[1] = point.last[0];
        point.last[0] = c.normals[v];
        point.unit_normal = vertices_[v].unit_normal;
        point.count = std::min(point.count + 1, 2u);
      }
    }
  }

  NormalFields code_normal(NormalFields fields, NormalFields predicted) {
    const NormalFormat& format = format_of(encoding_);
    uint32_t chart = predicted.chart;
    NormalFields flat{};
    if constexpr (!kDecodes) {
      const auto unfolded = unfold_normal(encoding_, fields, chart);
      flat = unfolded ? *unfolded : fields;
    }
    if (format.charts > 1 && flag(context::kNormalSeam, flat.chart != chart) != 0)
      chart = std::min(static_cast<uint32_t>(coder_.raw(context::kNormalSeam, flat.chart, 3)), format.charts - 1);
    const int64_t dx = difference(context::kNormalX + normals_.expected_error(), flat.x - predicted.x);
    const auto width = static_cast<uint32_t>(std::bit_width(wrap(dx < 0 ? ~dx : dx)));
    const int64_t dy = difference(context::kNormalY + std::min(width, 15u), flat.y - predicted.y);
    const auto limit = [](int64_t value) {
      return static_cast<int32_t>(std::clamp<int64_t>(value, -(1 << 28), 1 << 28));
    };
    return fold_normal(encoding_, {chart, limit(predicted.x + limit(dx)), limit(predicted.y + limit(dy))});
  }

  NormalSurroundings surroundings(uint32_t v) const {
    const Vertex& vertex = vertices_[v];
    NormalSurroundings s{.face_sum = vertex.face_sum, .triangle_count = vertex.triangle_count};
    for (const uint16_t n : vertex.neighbours) {
      if (n == kNoVertex) break;
      s.neighbours[s.neighbour_count] = DVec3(vertices_[n].unit_normal);
      s.edges[s.neighbour_count++] = steps_between(values_->positions[n], values_->positions[v]);
    }
    if (s.neighbour_count == 2 && vertex.opposite != kNone && normals_at_[vertex.opposite].count > 0) {
      s.has_opposite = true;
      s.opposite = DVec3(normals_at_[vertex.opposite].unit_normal);
    }
    return s;
  }

  /// Sums the cross products of the cluster's triangles at their vertices.
  void sum_face_normals() {
    const auto& positions = values_->positions;
    for (uint32_t i = 0; i < values_->triangle_count; ++i) {
      const auto& [a, b, c] = corners_of_[i];
      const DVec3 normal =
          glm::cross(steps_between(positions[a], positions[b]), steps_between(positions[a], positions[c]));
      for (const uint16_t corner : corners_of_[i]) {
        vertices_[corner].face_sum += normal;
        ++vertices_[corner].triangle_count;
      }
    }
  }

  void code_uvs() {
    ClusterValues& c = *values_;
    UvLattice last{};
    for (uint32_t v = 0; v < vertex_count_; ++v) {
      const uint16_t near = vertices_[v].neighbours[0];
      const UvLattice from = near != kNoVertex ? c.uvs[near] : last;
      for (size_t axis = 0; axis < 2; ++axis) {
        const int64_t delta =
            difference(context::kUv + static_cast<uint32_t>(axis), int64_t{c.uvs[v][axis]} - from[axis]);
        c.uvs[v][axis] = static_cast<int32_t>(static_cast<uint32_t>(static_cast<uint64_t>(from[axis]) + wrap(delta)));
      }
      last = c.uvs[v];
    }
  }

  NormalEncoding encoding_{};
  struct {
    uint32_t material = 0;
    bool has_normals = false, has_uvs = false;
  } last_;
  NormalPredictor normals_;
  std::vector<PagePointNormals> normals_at_; // per point; shorter than points_ if the last clusters have no normals
};

} // namespace packtrace
