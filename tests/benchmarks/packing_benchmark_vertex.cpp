#include "tests/benchmarks/packing_benchmark_vertex.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace packtrace {
namespace {

constexpr float kMax16 = 65535.0f;

/// Octahedral map to two signed 16-bit numbers.
/// Source: Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors, JCGT 3(2), 2014.
std::array<int16_t, 2> encode_octahedral(Vec3 n) {
  const Vec3 p = n / (std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
  Vec2 folded(p.x, p.y);
  if (p.z < 0.0f) folded = {std::copysign(1.0f - std::abs(p.y), p.x), std::copysign(1.0f - std::abs(p.x), p.y)};
  return {static_cast<int16_t>(std::lround(folded.x * 32767.0f)),
          static_cast<int16_t>(std::lround(folded.y * 32767.0f))};
}

Vec3 decode_octahedral(const std::array<int16_t, 2>& code) {
  const Vec2 e = Vec2(code[0], code[1]) / 32767.0f;
  Vec3 n(e.x, e.y, 1.0f - std::abs(e.x) - std::abs(e.y));
  if (n.z < 0.0f) {
    n.x = std::copysign(1.0f - std::abs(e.y), e.x);
    n.y = std::copysign(1.0f - std::abs(e.x), e.y);
  }
  return glm::normalize(n);
}

template <typename Field>
void put(std::byte*& at, const Field& field) {
  std::memcpy(at, &field, sizeof(field));
  at += sizeof(field);
}

template <typename Field>
Field take(const std::byte*& at) {
  Field field;
  std::memcpy(&field, at, sizeof(field));
  at += sizeof(field);
  return field;
}

template <typename Coordinate>
void put_position(std::byte*& at, const FixedVertices& layout, Vec3 p) {
  std::array<Coordinate, 4> fields{};
  for (int axis = 0; axis < 3; ++axis)
    fields[static_cast<size_t>(axis)] =
        static_cast<Coordinate>(std::llrint((double{p[axis]} - double{layout.box.lo[axis]}) / layout.step));
  put(at, fields);
}

template <typename Coordinate>
Vec3 take_position(const std::byte*& at, const DVec3 lo, double step) {
  const auto fields = take<std::array<Coordinate, 4>>(at);
  return {lo + step * DVec3(fields[0], fields[1], fields[2])};
}

} // namespace

double angle_degrees(Vec3 a, Vec3 b) {
  const DVec3 x(a), y(b);
  return glm::degrees(std::atan2(glm::length(glm::cross(x, y)), glm::dot(x, y)));
}

size_t FixedVertices::stride() const { return (wide ? 16u : 8u) + (has_normals ? 4u : 0u) + (has_uvs ? 4u : 0u); }

FixedVertices pack_vertices(const Mesh& mesh, const PackingPrecision& precision) {
  FixedVertices out;
  out.box = packing_box(mesh);
  out.step = precision.step;
  out.wide = std::ceil(out.box.side / out.step) > kMax16;
  out.has_normals = !mesh.normals.empty();
  out.has_uvs = !mesh.uvs.empty();
  out.vertex_count = mesh.positions.size();
  if (out.has_uvs) {
    Vec2 hi = out.uv_lo = mesh.uvs.front();
    for (const Vec2 uv : mesh.uvs) out.uv_lo = glm::min(out.uv_lo, uv), hi = glm::max(hi, uv);
    out.uv_step = (hi - out.uv_lo) / kMax16;
  }
  out.bytes.resize(out.vertex_count * out.stride());
  std::byte* at = out.bytes.data();
  for (size_t i = 0; i < out.vertex_count; ++i) {
    if (out.wide)
      put_position<uint32_t>(at, out, mesh.positions[i]);
    else
      put_position<uint16_t>(at, out, mesh.positions[i]);
    if (out.has_normals) put(at, encode_octahedral(mesh.normals[i]));
    if (!out.has_uvs) continue;
    std::array<uint16_t, 2> fields{};
    for (int axis = 0; axis < 2; ++axis)
      if (out.uv_step[axis] > 0.0f)
        fields[static_cast<size_t>(axis)] = static_cast<uint16_t>(
            std::clamp((mesh.uvs[i][axis] - out.uv_lo[axis]) / out.uv_step[axis] + 0.5f, 0.0f, kMax16));
    put(at, fields);
  }
  return out;
}

void unpack_vertices(const FixedVertices& layout, std::span<const std::byte> bytes, PlainMesh& out) {
  out.positions.resize(layout.vertex_count);
  if (layout.has_normals) out.normals.resize(layout.vertex_count);
  if (layout.has_uvs) out.uvs.resize(layout.vertex_count);
  const std::byte* at = bytes.data();
  const DVec3 lo(layout.box.lo);
  for (size_t i = 0; i < layout.vertex_count; ++i) {
    out.positions[i] =
        layout.wide ? take_position<uint32_t>(at, lo, layout.step) : take_position<uint16_t>(at, lo, layout.step);
    if (layout.has_normals) out.normals[i] = decode_octahedral(take<std::array<int16_t, 2>>(at));
    if (!layout.has_uvs) continue;
    const auto fields = take<std::array<uint16_t, 2>>(at);
    out.uvs[i] = layout.uv_lo + layout.uv_step * Vec2(fields[0], fields[1]);
  }
}

PackingErrors compare_vertices(const Mesh& source, const PlainMesh& decoded, std::span<const uint32_t> source_vertex) {
  PackingErrors errors;
  double normal_sum = 0.0, normal_max = 0.0, uv_max = 0.0;
  for (size_t i = 0; i < decoded.positions.size(); ++i) {
    const size_t s = source_vertex.empty() ? i : source_vertex[i];
    const DVec3 off = glm::abs(DVec3(decoded.positions[i]) - DVec3(source.positions[s]));
    errors.position = std::max({errors.position, off.x, off.y, off.z});
    if (!decoded.normals.empty()) {
      const double angle = angle_degrees(decoded.normals[i], source.normals[s]);
      normal_sum += angle;
      normal_max = std::max(normal_max, angle);
    }
    if (decoded.uvs.empty()) continue;
    const Vec2 uv_off = glm::abs(decoded.uvs[i] - source.uvs[s]);
    uv_max = std::max({uv_max, double{uv_off.x}, double{uv_off.y}});
  }
  if (!decoded.normals.empty()) {
    errors.normal_max_degrees = normal_max;
    errors.normal_mean_degrees = normal_sum / static_cast<double>(decoded.positions.size());
  }
  if (!decoded.uvs.empty()) errors.uv = uv_max;
  errors.lost_triangles = source.triangles.size() - std::min(source.triangles.size(), decoded.triangles.size());
  return errors;
}

} // namespace packtrace
