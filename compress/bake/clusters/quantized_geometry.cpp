#include "compress/bake/clusters/quantized_geometry.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "compress/bake/clusters/coinciding_triangles.h"
#include "compress/bake/clusters/error_stats.h"
#include "compress/bake/clusters/flat_regions.h"
#include "compress/bake/clusters/normal_quantizer.h"
#include "compress/bake/grid/welded_surface.h"
#include "compress/format/cluster/normal_codec.h"
#include "pbrt_import/base/brief.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/weld_table.h"

namespace packtrace {
namespace {

class Quantizer {
public:
  Quantizer(const Scene& scene, const GeometryPlan& plan, const GeometryNeeds& needs, const BakeConfig& config,
            const GeometryGrid& grid, const GeometryMeasure& measure)
      : scene_(scene), plan_(plan), needs_(needs), config_(config), source_(scene, plan), measure_(measure),
        grid_(grid), step_(grid.grid.step()), limits_(config.normal_limits(step_ / measure.median_edge)),
        vertex_table_(2 * count_vertices()) {
    out_.grid = grid.grid;
    out_.uv_encoding = config.uvs.value_or(UvEncoding::kLattice);
    if (out_.uv_encoding == UvEncoding::kLattice) out_.uv_exponent = needs.uv_exponent;
  }

  QuantizedGeometry run() {
    const double max_abs = measure_.max_abs();
    const DVec3 lowest = measure_.bounds.lo, highest = measure_.bounds.hi;
    check_limits(max_abs);
    for (int axis = 0; axis < 3 && lowest[axis] <= highest[axis]; ++axis) {
      const int64_t lo = grid_.lowest(lowest[axis]), hi = grid_.highest(highest[axis]);
      out_.origin[static_cast<size_t>(axis)] = lo;
      const auto bits = static_cast<uint32_t>(std::bit_width(static_cast<uint64_t>(hi - lo)));
      out_.anchor_shift = std::max(out_.anchor_shift, bits > 31 ? bits - 31 : 0u);
    }
    std::vector<LatticePart> lattice;
    for (const GeometryPart& part : plan_.parts) lattice.push_back(place_on_lattice(part));
    surface_ = weld_surface(scene_, plan_, lattice);
    std::vector<QuantizedPart> parts(plan_.parts.size());
    size_t first_triangle = 0;
    for (size_t i = 0; i < parts.size(); ++i) {
      parts[i] = quantize_part(i, std::move(lattice[i]), first_triangle);
      first_triangle += parts[i].triangles.size();
    }
    choose_flat_triangles(parts);
    out_.normal_encoding = config_.normals ? *config_.normals : choose_normal_encoding(parts, limits_.error_degrees);
    CoincidingTriangles coinciding(source_, count_merged());
    out_.vertices.reserve(surface_.positions.size());
    out_.triangles.reserve(surface_.corners.size()), out_.kind_of.reserve(surface_.corners.size());
    for (size_t i = 0; i < parts.size(); ++i) {
      encode_normals(out_.normal_encoding, parts[i], out_.stats);
      weld(i, parts[i], coinciding);
      parts[i] = {};
    }
    out_.positions = std::move(surface_.positions);
    out_.sources = std::move(surface_.sources);
    remove_empty_slots();
    out_.stats.collapsed_triangles = surface_.collapsed_count;
    out_.stats.source_area = surface_.source_area;
    out_.stats.collapsed_area = surface_.collapsed_area;
    out_.stats.left = std::move(surface_.left);
    require_bound("position error", out_.stats.max_position_error,
                  position_error_bound(grid_.coarsest_step(), max_abs));
    require_bound("normal error in degrees", out_.stats.max_normal_error_degrees, weld_limit());
    out_.stats.distinct_vertices = out_.vertices.size();
    return std::move(out_);
  }

private:
  size_t count_vertices() const {
    size_t vertices = 0, triangles = 0;
    for (const GeometryPart& part : plan_.parts) {
      vertices += scene_.meshes[part.mesh].positions.size();
      triangles += scene_.meshes[part.mesh].triangles.size();
    }
    // Vertex numbers of a file count the vertices of each cluster separately: up to three per triangle.
    constexpr size_t kMax = std::numeric_limits<uint32_t>::max() / 4;
    if (vertices > kMax || triangles > kMax)
      throw Error(ErrorKind::kLimitExceeded,
                  plan_.name + ": more than " + std::to_string(kMax) + " vertices or triangles in one geometry");
    return vertices;
  }

  void check_limits(double max_abs) const {
    if (fits_lattice(max_abs, step_)) {
      if (std::isfinite(from_lattice(to_lattice(max_abs, step_), step_))) return;
      throw Error(ErrorKind::kLimitExceeded, plan_.name + ": coordinates up to " + brief(max_abs) +
                                                 " round to more than the largest float at a step of " + brief(step_) +
                                                 "; choose a finer precision");
    }
    throw Error(ErrorKind::kLimitExceeded, plan_.name + ": coordinates up to " + brief(max_abs) + " at a step of " +
                                               brief(step_) + " exceed the lattice limit of 2^" +
                                               std::to_string(kMaxLatticeBits) + " steps; choose a coarser precision");
  }

  void require_bound(const char* what, double measured, double bound) const {
    if (measured > bound)
      throw Error(ErrorKind::kLimitExceeded,
                  plan_.name + ": measured " + what + " " + brief(measured) + " exceeds its bound " + brief(bound));
  }

  LatticePart place_on_lattice(const GeometryPart& part) {
    const Mesh& mesh = scene_.meshes[part.mesh];
    LatticePart result;
    quantize_positions(part, mesh, result.points);
    result.triangles = mesh.triangles;
    if (part.flip)
      for (Triangle& t : result.triangles) std::swap(t.y, t.z);
    out_.stats.source_vertices += mesh.positions.size();
    return result;
  }

  QuantizedPart quantize_part(size_t number, LatticePart&& lattice, size_t first_triangle) {
    const GeometryPart& part = plan_.parts[number];
    const PartNeeds& needs = needs_.parts[number];
    const Mesh& mesh = scene_.meshes[part.mesh];
    QuantizedPart work;
    work.lattice = std::move(lattice.points);
    work.triangles = std::move(lattice.triangles);
    work.collapsed = std::span(surface_.collapsed).subspan(first_triangle, work.triangles.size());
    work.corners = std::span(surface_.corners).subspan(first_triangle, work.triangles.size());
    work.flat.assign(work.triangles.size(), 1);
    if (needs.store_normals()) quantize_normals(part, mesh, work, out_.stats);
    if (may_infer_normals(needs)) find_flat_triangles(limits_.flat_degrees, work);
    if (needs.store_uvs()) quantize_uvs(mesh, work);
    return work;
  }

  bool may_infer_normals(const PartNeeds& needs) const {
    return needs.store_normals() && needs.normals != baked::kOnRequest && needs_.infer_normals;
  }

  /// Decides which flat triangles go without normals.
  void choose_flat_triangles(std::span<QuantizedPart> parts) {
    if (needs_.infer_normals) choose_flat_regions(parts, surface_, estimated_bits());
    for (size_t i = 0; i < parts.size(); ++i) {
      if (parts[i].normals.empty()) continue;
      find_smooth_normals(parts[i], out_.stats);
      if (may_infer_normals(needs_.parts[i]))
        out_.stats.inferred_normals +=
            static_cast<uint64_t>(std::count(parts[i].smooth.begin(), parts[i].smooth.end(), uint8_t{0}));
    }
  }

  /// Bits of a vertex in a typical cluster, which is about ten edges wide. A normal counts for more
  /// than the bits of its code, because without it the other normals of a cluster often need narrower fields. The
  /// factor is the one that gave the smallest files.
  VertexBits estimated_bits() const {
    const double steps = 10.0 * measure_.median_edge / step_;
    const uint32_t normal_bits =
        config_.normals ? format_of(*config_.normals).bits : expected_normal_bits(limits_.error_degrees);
    return {3.0 * std::log2(std::clamp(steps, 0x1p3, 0x1p32)), 1.275 * normal_bits};
  }

  void quantize_positions(const GeometryPart& part, const Mesh& mesh, std::vector<LatticePoint>& lattice) {
    lattice.resize(mesh.positions.size());
    const PartMap place(part);
    const ErrorStats errors = accumulate_errors(mesh.positions.size(), [&](size_t i, ErrorStats& stats) {
      const DVec3 p = place(mesh.positions[i]);
      lattice[i] = grid_.round(p);
      for (int axis = 0; axis < 3; ++axis)
        stats.add(std::abs(static_cast<double>(from_lattice(lattice[i][static_cast<size_t>(axis)], step_)) - p[axis]));
    });
    out_.stats.max_position_error = std::max(out_.stats.max_position_error, errors.max);
    out_.stats.position_error_squares += errors.squares;
    out_.stats.position_error_count += errors.count;
  }

  void quantize_uvs(const Mesh& mesh, QuantizedPart& work) {
    if (mesh.uvs.empty()) return; // (0, 0) everywhere
    if (mesh.uvs.size() != mesh.positions.size())
      throw Error(ErrorKind::kInput, mesh.name + ": texture coordinates and positions differ in number");
    work.uvs.resize(mesh.uvs.size());
    for (size_t i = 0; i < work.uvs.size(); ++i) {
      const bool finite = std::isfinite(mesh.uvs[i].x) && std::isfinite(mesh.uvs[i].y);
      out_.stats.replaced_uvs += !finite;
      for (size_t axis = 0; axis < 2 && finite; ++axis)
        work.uvs[i][axis] = quantize_uv(mesh, axis, mesh.uvs[i][static_cast<int>(axis)]);
    }
  }

  int32_t quantize_uv(const Mesh& mesh, size_t axis, float uv) {
    const std::optional<int32_t> code = encode_uv(out_.uv_encoding, uv, out_.uv_exponent[axis]);
    if (!code)
      throw Error(ErrorKind::kLimitExceeded, mesh.name + ": texture coordinate " + brief(uv) + " is beyond what " +
                                                 std::string(kUvEncodingNames[static_cast<size_t>(out_.uv_encoding)]) +
                                                 " holds");
    const double decoded = UvDecoder(out_.uv_encoding, out_.uv_exponent[axis])(*code);
    const double error = std::abs(decoded - static_cast<double>(uv));
    out_.stats.max_uv_error = std::max(out_.stats.max_uv_error, error);
    out_.stats.max_uv_error_texels = std::max(out_.stats.max_uv_error_texels, error * needs_.texels_per_uv[axis]);
    return *code;
  }

  bool at_merged(const Triangle& corners) const {
    return surface_.merged[corners.x] != 0 || surface_.merged[corners.y] != 0 || surface_.merged[corners.z] != 0;
  }

  /// Counts triangles that may coincide with another one.
  size_t count_merged() const {
    size_t count = 0;
    for (size_t i = 0; i < surface_.corners.size(); ++i)
      count += surface_.collapsed[i] == 0 && at_merged(surface_.corners[i]);
    return count;
  }

  /// Largest angle between a source normal and the decoded normal of another vertex that replaces it. Where
  /// normal_limits() allows larger errors because the grid is coarse, the encoding's own error is added, so that it
  /// does not reduce the angle within which vertices share a normal.
  double weld_limit() const {
    const bool chosen = !config_.normals && !config_.normal_error_degrees;
    if (!chosen || limits_.error_degrees <= kDefaultNormalError) return limits_.error_degrees;
    return limits_.error_degrees + format_of(out_.normal_encoding).max_error_degrees;
  }

  uint32_t weld_vertex(const QuantizedVertex& v) {
    const uint64_t uv = static_cast<uint32_t>(v.uv[0]) | (uint64_t{static_cast<uint32_t>(v.uv[1])} << 32);
    const auto next = static_cast<uint32_t>(out_.vertices.size());
    const uint32_t number = vertex_table_.find_or_add(mix_words(v.position, v.normal_code, uv), next,
                                                      [&](uint32_t other) { return out_.vertices[other] == v; });
    if (number == next) out_.vertices.push_back(v);
    return number;
  }

  /// Welds a vertex at a position where several source points merged. It reuses a vertex with the same UV whose normal
  /// is within weld_limit(): otherwise, coarse lattices would store many normals per position that differ by less than
  /// the lattice tilts the faces.
  uint32_t weld_smooth_vertex(QuantizedVertex v, DVec3 normal) {
    constexpr uint32_t kUnset = ~0u;
    if (smooth_at_.empty()) smooth_at_.assign(surface_.positions.size(), kUnset);
    constexpr uint32_t kMaxCompared = 32; // bounds the time where thousands of vertices merged
    uint32_t compared = 0;
    for (uint32_t i = smooth_at_[v.position]; i != kUnset && compared < kMaxCompared;
         i = smooth_vertices_[i].next, ++compared) {
      const QuantizedVertex& other = out_.vertices[smooth_vertices_[i].vertex];
      const double error = normal_encoding_error(out_.normal_encoding, normal, other.normal_code);
      if (other.uv != v.uv || error > weld_limit()) continue;
      out_.stats.normal_error_sum += error - normal_encoding_error(out_.normal_encoding, normal, v.normal_code);
      out_.stats.max_normal_error_degrees = std::max(out_.stats.max_normal_error_degrees, error);
      return smooth_vertices_[i].vertex;
    }
    const uint32_t number = weld_vertex(v);
    smooth_vertices_.push_back({number, smooth_at_[v.position]});
    smooth_at_[v.position] = static_cast<uint32_t>(smooth_vertices_.size() - 1);
    return number;
  }

  uint32_t kind_number(const TriangleKind& kind) {
    const auto found = std::find(out_.kinds.begin(), out_.kinds.end(), kind);
    if (found == out_.kinds.end()) out_.kinds.push_back(kind);
    return static_cast<uint32_t>(std::find(out_.kinds.begin(), out_.kinds.end(), kind) - out_.kinds.begin());
  }

  /// Assigns vertices to the part's triangles and appends those that neither collapsed nor coincide with another one.
  void weld(size_t part, const QuantizedPart& work, CoincidingTriangles& coinciding) {
    constexpr uint32_t kUnset = ~0u;
    const bool uvs = needs_.parts[part].store_uvs();
    std::array<std::vector<uint32_t>, 2> vertex_of; // of smooth and of flat triangles
    for (auto& numbers : vertex_of) numbers.assign(work.lattice.size(), kUnset);
    std::array<uint32_t, 2> kinds{kUnset, kUnset};
    for (size_t i = 0; i < work.triangles.size(); ++i) {
      if (!work.stays(i)) continue;
      const uint8_t flat = work.flat[i];
      if (kinds[flat] == kUnset) kinds[flat] = kind_number({plan_.parts[part].slot, flat != 0, uvs});
      const Triangle& corners = work.corners[i];
      Triangle t{};
      for (int corner = 0; corner < 3; ++corner) {
        const uint32_t source = work.triangles[i][corner];
        uint32_t& number = vertex_of[flat][source];
        if (number == kUnset) {
          QuantizedVertex v{corners[corner], 0, work.uvs.empty() ? UvLattice{} : work.uvs[source]};
          if (flat == 0) v.normal_code = work.codes[source];
          number = flat == 0 && surface_.merged[v.position] != 0 ? weld_smooth_vertex(v, work.normals[source])
                                                                 : weld_vertex(v);
        }
        t[corner] = number;
      }
      if (at_merged(corners) && coinciding.repeats(t, kinds[flat], {static_cast<uint32_t>(part), work.triangles[i]})) {
        ++out_.stats.coinciding_triangles;
        --surface_.left[part];
        out_.stats.flat_triangles -= flat != 0 && !work.normals.empty();
        continue;
      }
      out_.triangles.push_back(t);
      out_.kind_of.push_back(kinds[flat]);
    }
  }

  /// Renumbers the material slots, without those that have no triangles left.
  void remove_empty_slots() {
    std::vector<uint32_t> number_of(plan_.slot_class.size());
    for (const TriangleKind& kind : out_.kinds) number_of[kind.slot] = 1;
    for (uint32_t slot = 0; slot < number_of.size(); ++slot) {
      if (number_of[slot] == 0) continue;
      number_of[slot] = static_cast<uint32_t>(out_.slots.size());
      out_.slots.push_back(slot);
      out_.slot_class.push_back(plan_.slot_class[slot]);
    }
    for (TriangleKind& kind : out_.kinds) kind.slot = number_of[kind.slot];
  }

  const Scene& scene_;
  const GeometryPlan& plan_;
  const GeometryNeeds& needs_;
  const BakeConfig& config_;
  const SourcePoints source_;
  const GeometryMeasure& measure_;
  const GeometryGrid& grid_;
  double step_;
  NormalLimits limits_;
  WeldTable vertex_table_;
  WeldedSurface surface_;
  struct SmoothVertex {
    uint32_t vertex, next; ///< next: index in smooth_vertices_ of the previous vertex at the same position
  };
  std::vector<SmoothVertex> smooth_vertices_; // at merged positions
  std::vector<uint32_t> smooth_at_;           // per position: index of its last entry in smooth_vertices_
  QuantizedGeometry out_;
};

} // namespace

QuantizedGeometry quantize_geometry(const Scene& scene, const GeometryPlan& plan, const GeometryNeeds& needs,
                                    const BakeConfig& config, const GeometryGrid& grid,
                                    const GeometryMeasure& measure) {
  return Quantizer(scene, plan, needs, config, grid, measure).run();
}

} // namespace packtrace
