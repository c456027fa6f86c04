#include "compress/exchange/vertex16/vertex16_geometry.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>

#include "compress/exchange/vertex16/vertex16_fields.h"
#include "compress/format/cluster/tangent_codec.h"
#include "pbrt_import/base/disjoint_sets.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/weld_table.h"
#include "pbrt_import/scene/angle.h"

namespace packtrace {
namespace {

constexpr int64_t kPositionCodes = int64_t{1} << 21, kUvCodes = int64_t{1} << 16;
constexpr uint32_t kMaxVertices16BitIndices =
    65535; // most vertices with 16-bit indices: 0xffff stays free for primitive restart

/// A vertex as decoded from the baked file.
struct SourceVertex {
  LatticePoint position{};
  uint32_t normal = kVertex16FlatNormal;
  uint32_t mirrored = 0; ///< sign bit of the tangent frame
  Vec2 uv{0.0f};
  bool operator==(const SourceVertex&) const = default;
  uint64_t hash() const {
    const uint64_t place = mix_words(static_cast<uint64_t>(position[0]), static_cast<uint64_t>(position[1]),
                                     static_cast<uint64_t>(position[2]));
    const uint64_t uvs = std::bit_cast<uint32_t>(uv.x) | (uint64_t{std::bit_cast<uint32_t>(uv.y)} << 32);
    return mix_words(place, normal | (uint64_t{mirrored} << 32), uvs);
  }
};

/// Whether texture coordinates that differ by integers look up the same texels.
template <class Record>
bool repeats_every_tile(const Record& mask) {
  const auto whole = [](float f) { return f == std::floor(f); };
  return mask.wrap == static_cast<uint32_t>(WrapMode::kRepeat) && whole(mask.uv_scale[0]) && whole(mask.uv_scale[1]);
}

class GeometryExporter {
public:
  GeometryExporter(const BakedFile& file, uint32_t geometry, std::span<const uint32_t> runs, uint32_t shift)
      : file_(file), source_(file.geometries()[geometry]), geometry_(geometry), shift_(shift),
        step_(PositionGrid{source_.step_mantissa, source_.step_exponent}.step()), slots_(source_.slot_count),
        table_(std::max<size_t>(source_.vertex_count, size_t{3} * source_.triangle_count)) {
    const BakedSections& s = file.sections();
    for (const uint32_t run : runs)
      for (uint32_t slot = 0; slot < source_.slot_count; ++slot) {
        const baked::MaterialRecord& material = s.materials[s.material_slots[run + slot]];
        slots_[slot].normal_map |= (material.flags & kNormalMap) != 0;
        slots_[slot].repeats = slots_[slot].repeats && every_texture_repeats(material);
      }
  }

  Vertex16Geometry run() {
    for (uint32_t c = 0; c < source_.cluster_count; ++c) add_cluster(file_.cluster(geometry_, c));
    record_.vertex_count = static_cast<uint32_t>(vertices_.size());
    record_.draw_count = static_cast<uint32_t>(out_.draws.size());
    record_.slot_count = source_.slot_count;
    record_.index_bits = record_.vertex_count <= kMaxVertices16BitIndices ? 16 : 32;
    if (tiles_repeat_) move_charts_to_the_first_tile();
    choose_frame();
    out_.vertices.reserve(vertices_.size());
    for (uint32_t v = 0; v < vertices_.size(); ++v) out_.vertices.push_back(encode(v));
    return std::move(out_);
  }

private:
  /// Properties of all materials that instances assign to a slot.
  struct Slot {
    bool normal_map = false; ///< any of them has a normal map
    bool repeats = true;     ///< integer offsets of texture coordinates change nothing
  };

  DVec3 decoded(const LatticePoint& q) const {
    return {from_lattice(q[0], step_), from_lattice(q[1], step_), from_lattice(q[2], step_)};
  }

  void add_cluster(const ClusterView& view) {
    const Slot& slot = slots_[view.material_slot()];
    const bool tangents = slot.normal_map && view.has_normals() && view.has_uvs();
    if (view.has_uvs()) tiles_repeat_ = tiles_repeat_ && slot.repeats;
    begin_draw(view.material_slot(), (view.has_normals() ? 0 : vertex16::kDrawFlat) |
                                         (view.has_uvs() ? vertex16::kDrawUvs : 0) |
                                         (tangents ? vertex16::kDrawTangents : 0));
    std::array<SourceVertex, kMaxClusterVertices> vertices;
    for (uint32_t v = 0; v < view.vertex_count(); ++v) vertices[v] = source_vertex(view, v);
    for (uint32_t i = 0; i < view.triangle_count(); ++i) add_triangle(view, view.triangle(i), vertices, tangents);
  }

  bool every_texture_repeats(const baked::MaterialRecord& material) const {
    for (const uint32_t mask : {material.alpha_mask, material.shadow_alpha_mask})
      if (mask != baked::kNone && !repeats_every_tile(file_.sections().masks[mask])) return false;
    return material.albedo_texture == baked::kNone ||
           repeats_every_tile(file_.sections().textures[material.albedo_texture]);
  }

  void begin_draw(uint32_t slot, uint32_t flags) {
    if (!out_.draws.empty() && out_.draws.back().material_slot == slot && out_.draws.back().flags == flags) return;
    vertex16::DrawRecord draw{};
    draw.first_index = static_cast<uint32_t>(out_.indices.size());
    draw.geometry = geometry_;
    draw.material_slot = slot;
    draw.flags = flags;
    out_.draws.push_back(draw);
  }

  SourceVertex source_vertex(const ClusterView& view, uint32_t v) {
    SourceVertex vertex;
    vertex.position = view.lattice(v);
    if (view.has_uvs()) vertex.uv = view.uv(v) + Vec2(0.0f); // turns -0 into 0
    if (!view.has_normals()) return vertex;
    if (view.normal_encoding() == NormalEncoding::kAxis24) {
      vertex.normal = view.normal_code(v);
      return vertex;
    }
    const DVec3 normal(view.normal(v));
    vertex.normal = encode_normal(NormalEncoding::kAxis24, normal);
    const DVec3 back(decode_normal(NormalEncoding::kAxis24, vertex.normal));
    record_.max_normal_error_degrees =
        std::max(record_.max_normal_error_degrees,
                 static_cast<float>(angle_degrees(glm::normalize(normal), glm::normalize(back))));
    return vertex;
  }

  void add_triangle(const ClusterView& view, const Triangle& t,
                    const std::array<SourceVertex, kMaxClusterVertices>& vertices, bool tangents) {
    UvTangent from_uv;
    DVec3 cross(0.0);
    if (tangents) {
      std::array<DVec3, 3> positions;
      std::array<glm::dvec2, 3> uvs;
      for (int corner = 0; corner < 3; ++corner) {
        positions[static_cast<size_t>(corner)] = decoded(vertices[t[corner]].position);
        uvs[static_cast<size_t>(corner)] = glm::dvec2(vertices[t[corner]].uv);
      }
      from_uv = uv_tangent(positions, uvs);
      cross = glm::cross(positions[1] - positions[0], positions[2] - positions[0]);
    }
    for (int corner = 0; corner < 3; ++corner) {
      SourceVertex vertex = vertices[t[corner]];
      if (tangents)
        vertex.mirrored = (glm::dot(DVec3(view.normal(t[corner])), cross) < 0.0) != from_uv.mirrored ? 1 : 0;
      const uint32_t number = weld(vertex);
      tangents_[number] += from_uv.tangent * from_uv.area;
      has_tangent_[number] = static_cast<uint8_t>(has_tangent_[number] | (tangents ? 1 : 0));
      out_.indices.push_back(number);
    }
    out_.draws.back().index_count += 3;
  }

  uint32_t weld(const SourceVertex& vertex) {
    const auto next = static_cast<uint32_t>(vertices_.size());
    const uint32_t number =
        table_.find_or_add(vertex.hash(), next, [&](uint32_t other) { return vertices_[other] == vertex; });
    if (number == next) vertices_.push_back(vertex), tangents_.emplace_back(0.0), has_tangent_.push_back(0);
    return number;
  }

  /// Subtracts from each chart (vertices connected by triangles) the integer tile of its smallest coordinates.
  void move_charts_to_the_first_tile() {
    DisjointSets charts(vertices_.size());
    for (size_t i = 0; i < out_.indices.size(); i += 3)
      for (size_t corner = 1; corner < 3; ++corner) charts.join(out_.indices[i], out_.indices[i + corner]);
    std::vector<Vec2> tile(vertices_.size(), Vec2(std::numeric_limits<float>::infinity()));
    for (uint32_t v = 0; v < vertices_.size(); ++v)
      tile[charts.root(v)] = glm::min(tile[charts.root(v)], glm::floor(vertices_[v].uv));
    tile_.reserve(vertices_.size());
    for (uint32_t v = 0; v < vertices_.size(); ++v) tile_.push_back(tile[charts.root(v)]);
  }

  glm::dvec2 tiled_uv(uint32_t v) const {
    return glm::dvec2(vertices_[v].uv) - (tile_.empty() ? glm::dvec2(0.0) : glm::dvec2(tile_[v]));
  }

  void choose_frame() {
    const LatticeBox box = lattice_box(file_, geometry_);
    for (int axis = 0; axis < 3; ++axis)
      record_.frame.origin[axis] = static_cast<int32_t>(coarser_lattice(box.lo[static_cast<size_t>(axis)], shift_));
    const double step = step_ * std::ldexp(1.0, static_cast<int>(shift_));
    record_.frame.step = static_cast<float>(step);
    if (static_cast<double>(record_.frame.step) != step)
      throw Error(ErrorKind::kLimitExceeded,
                  std::string(file_.text(source_.name)) + ": the step of its grid leaves the range of floats");
    glm::dvec2 lo(std::numeric_limits<double>::infinity()), hi(-std::numeric_limits<double>::infinity());
    for (uint32_t v = 0; v < vertices_.size(); ++v) lo = glm::min(lo, tiled_uv(v)), hi = glm::max(hi, tiled_uv(v));
    for (int axis = 0; axis < 2; ++axis) {
      int32_t exponent = 0;
      if (!vertices_.empty()) exponent = choose_uv_step(lo[axis], hi[axis]);
      const double uv_step = std::ldexp(1.0, exponent);
      record_.frame.uv_step[axis] = static_cast<float>(uv_step);
      if (!vertices_.empty())
        record_.frame.uv_origin[axis] = static_cast<int32_t>(std::floor(lo[axis] / uv_step + 0.5));
    }
    record_.bounds_lo.fill(std::numeric_limits<float>::infinity());
    record_.bounds_hi.fill(-std::numeric_limits<float>::infinity());
  }

  /// Returns the exponent of the finest power of two with which lo..hi spans at most 2^16 codes and |lo|, |hi| are less
  /// than 2^30 steps.
  static int32_t choose_uv_step(double lo, double hi) {
    const double largest = std::max({std::abs(lo), std::abs(hi), std::ldexp(1.0, -90)});
    if (lo == 0.0 && hi == 0.0) return 0;
    int32_t exponent = std::ilogb(largest) - 29;
    const auto code = [&](double uv) { return std::floor(std::ldexp(uv, -exponent) + 0.5); };
    while (code(hi) - code(lo) >= static_cast<double>(kUvCodes)) ++exponent;
    return exponent;
  }

  glm::uvec4 encode(uint32_t v) {
    const SourceVertex& source = vertices_[v];
    const vertex16::Vertex16Frame& frame = record_.frame;
    std::array<uint32_t, 3> position{};
    for (size_t axis = 0; axis < 3; ++axis)
      position[axis] =
          static_cast<uint32_t>(coarser_lattice(source.position[axis], shift_) - frame.origin[static_cast<int>(axis)]);
    std::array<uint32_t, 2> uv{};
    for (int axis = 0; axis < 2; ++axis)
      uv[static_cast<size_t>(axis)] = static_cast<uint32_t>(
          static_cast<int64_t>(std::floor(tiled_uv(v)[axis] / double{frame.uv_step[axis]} + 0.5)) -
          frame.uv_origin[axis]);
    const DVec3 normal(decode_normal(NormalEncoding::kAxis24, source.normal));
    const DVec3 tangent = has_tangent_[v] != 0 ? tangent_of(v, normal) : DVec3(0.0);
    const uint32_t angle =
        has_tangent_[v] != 0
            ? encode_diamond({glm::dot(tangent, DVec3(basis_x(normal))), glm::dot(tangent, DVec3(basis_y(normal)))}, 8)
            : 0;
    const glm::uvec4 packed = vertex16::vertex16_pack(position[0], position[1], position[2], source.mirrored,
                                                      source.normal, angle, uv[0], uv[1]);
    measure(v, packed, tangent);
    return packed;
  }

  static Vec3 basis_x(DVec3 normal) { return vertex16::vertex16_basis_x(Vec3(normal)); }
  static Vec3 basis_y(DVec3 normal) { return vertex16::vertex16_basis_y(Vec3(normal)); }

  /// Unit vector orthogonal to the normal.
  DVec3 tangent_of(uint32_t v, DVec3 normal) const {
    normal = glm::normalize(normal);
    const DVec3 sum = tangents_[v] - normal * glm::dot(normal, tangents_[v]);
    const double length = glm::length(sum), whole = glm::length(tangents_[v]);
    if (!(length > 1e-6 * whole) || !std::isfinite(length)) return DVec3(basis_x(normal));
    return sum / length;
  }

  void measure(uint32_t v, glm::uvec4 packed, DVec3 tangent) {
    const Vec3 position = vertex16::vertex16_position(packed, record_.frame);
    const DVec3 error = glm::abs(DVec3(position) - decoded(vertices_[v].position));
    const glm::dvec2 uv_error = glm::abs(glm::dvec2(vertex16::vertex16_uv(packed, record_.frame)) - tiled_uv(v));
    raise(record_.max_position_error, std::max({error.x, error.y, error.z}));
    raise(record_.max_uv_error, std::max(uv_error.x, uv_error.y));
    for (int axis = 0; axis < 3; ++axis) {
      float &lo = record_.bounds_lo[static_cast<size_t>(axis)], &hi = record_.bounds_hi[static_cast<size_t>(axis)];
      lo = std::min(lo, position[axis]), hi = std::max(hi, position[axis]);
    }
    if (has_tangent_[v] == 0) return;
    const Vec3 normal = vertex16::vertex16_decode_normal(packed);
    const DVec3 back(Vec3(vertex16::vertex16_tangent(packed, normal)));
    raise(record_.max_tangent_error_degrees, angle_degrees(tangent, glm::normalize(back)));
  }

  static void raise(float& largest, double value) { largest = std::max(largest, static_cast<float>(value)); }

  const BakedFile& file_;
  const baked::GeometryRecord& source_;
  uint32_t geometry_, shift_;
  double step_;
  std::vector<Slot> slots_;
  bool tiles_repeat_ = true;
  WeldTable table_;
  std::vector<SourceVertex> vertices_;
  std::vector<DVec3> tangents_;      // per vertex: sum weighted by triangle area
  std::vector<uint8_t> has_tangent_; // per vertex
  std::vector<Vec2> tile_;           // per vertex; empty if tiles are kept
  Vertex16Geometry out_;
  vertex16::GeometryRecord& record_ = out_.record;
};

} // namespace

LatticeBox lattice_box(const BakedFile& file, uint32_t geometry) {
  LatticeBox box;
  bool first = true;
  for (uint32_t c = 0; c < file.geometries()[geometry].cluster_count; ++c) {
    const ClusterView view = file.cluster(geometry, c);
    for (uint32_t v = 0; v < view.vertex_count(); ++v, first = false) {
      const LatticePoint p = view.lattice(v);
      for (size_t axis = 0; axis < 3; ++axis) {
        box.lo[axis] = first ? p[axis] : std::min(box.lo[axis], p[axis]);
        box.hi[axis] = first ? p[axis] : std::max(box.hi[axis], p[axis]);
      }
    }
  }
  return box;
}

uint32_t vertex16_shift(const LatticeBox& box) {
  constexpr int64_t kLargestOrigin = (int64_t{1} << 31) - kPositionCodes;
  for (uint32_t shift = 0;; ++shift) {
    bool fits = true;
    for (size_t axis = 0; axis < 3; ++axis) {
      const int64_t lo = coarser_lattice(box.lo[axis], shift), hi = coarser_lattice(box.hi[axis], shift);
      fits = fits && hi - lo < kPositionCodes && std::abs(lo) <= kLargestOrigin;
    }
    if (fits) return shift;
  }
}

Vertex16Geometry make_vertex16_geometry(const BakedFile& file, uint32_t geometry, std::span<const uint32_t> runs,
                                        uint32_t shift) {
  return GeometryExporter(file, geometry, runs, shift).run();
}

} // namespace packtrace
