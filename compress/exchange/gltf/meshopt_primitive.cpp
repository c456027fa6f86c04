#include "compress/exchange/gltf/meshopt_primitive.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include <meshoptimizer.h>
#include <tbb/parallel_invoke.h>

#include "compress/exchange/gltf/rail_strip.h"

namespace packtrace {
namespace {

constexpr int kByteBits = 8; // of a normal's component in 4 bytes; more take 8

/// All stored values of a vertex.
struct StoredVertex {
  LatticePoint lattice{};
  std::array<int16_t, 4> normal{};
  std::array<float, 2> uv{};
};
static_assert(sizeof(StoredVertex) == 40); // no padding: it is hashed as bytes

/// Rounds unit normals to octahedral codes.
std::vector<std::array<int16_t, 4>> code_normals(const std::vector<Vec3>& normals, int bits, double& max_error) {
  std::vector<glm::vec4> wide;
  wide.reserve(normals.size());
  for (const Vec3& n : normals) wide.emplace_back(n, 0.0f);
  std::vector<std::array<int16_t, 4>> codes(normals.size());
  // The codes of up to 8 bits are stored in bytes; they are computed in 16 bits first.
  if (bits <= kByteBits) {
    std::vector<std::array<int8_t, 4>> bytes(normals.size());
    meshopt_encodeFilterOct(bytes.data(), bytes.size(), sizeof(bytes[0]), bits, &wide[0].x);
    for (size_t i = 0; i < bytes.size(); ++i) std::copy(bytes[i].begin(), bytes[i].end(), codes[i].begin());
    meshopt_decodeFilterOct(bytes.data(), bytes.size(), sizeof(bytes[0]));
    for (size_t i = 0; i < bytes.size(); ++i) wide[i] = {bytes[i][0], bytes[i][1], bytes[i][2], 0.0f};
  } else {
    meshopt_encodeFilterOct(codes.data(), codes.size(), sizeof(codes[0]), bits, &wide[0].x);
    std::vector<std::array<int16_t, 4>> decoded = codes;
    meshopt_decodeFilterOct(decoded.data(), decoded.size(), sizeof(decoded[0]));
    for (size_t i = 0; i < codes.size(); ++i) wide[i] = {decoded[i][0], decoded[i][1], decoded[i][2], 0.0f};
  }
  for (size_t i = 0; i < normals.size(); ++i) {
    const double cosine = glm::dot(glm::normalize(DVec3(wide[i])), glm::normalize(DVec3(normals[i])));
    max_error = std::max(max_error, std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi);
  }
  return codes;
}

std::vector<StoredVertex> stored_vertices(const PlainPrimitive& plain, int normal_bits, const UvGrid& uvs,
                                          bool keep_uvs, double& max_error) {
  std::vector<StoredVertex> vertices(plain.lattice.size());
  for (size_t i = 0; i < vertices.size(); ++i) vertices[i].lattice = plain.lattice[i];
  if (!plain.normals.empty()) {
    const auto codes = code_normals(plain.normals, normal_bits, max_error);
    for (size_t i = 0; i < vertices.size(); ++i) vertices[i].normal = codes[i];
  }
  for (size_t i = 0; keep_uvs && i < plain.uvs.size(); ++i)
    for (int k = 0; k < 2; ++k) {
      const double uv = double{plain.uvs[i][k]};
      const double code = uvs.step > 0.0 ? std::round((uv - uvs.origin[k]) / uvs.step) : uv;
      vertices[i].uv[static_cast<size_t>(k)] = static_cast<float>(code + 0.0);
    }
  return vertices;
}

/// A primitive with the same vertices in another order, without triangles.
/// @param order by new number: the vertex
MeshoptPrimitive with_vertices(const MeshoptPrimitive& from, std::span<const uint32_t> order) {
  MeshoptPrimitive result;
  result.triangles = from.triangles, result.collapsed_triangles = from.collapsed_triangles;
  result.max_normal_error_degrees = from.max_normal_error_degrees;
  for (const uint32_t vertex : order) {
    result.lattice.push_back(from.lattice[vertex]);
    if (!from.normals.empty()) result.normals.push_back(from.normals[vertex]);
    if (!from.uvs.empty()) result.uvs.push_back(from.uvs[vertex]);
  }
  return result;
}

MeshoptPrimitive as_list(const MeshoptPrimitive& from, std::vector<uint32_t> indices) {
  std::vector<unsigned> number(from.lattice.size());
  const size_t used = meshopt_optimizeVertexFetchRemap(number.data(), indices.data(), indices.size(), number.size());
  std::vector<uint32_t> order(used);
  for (uint32_t vertex = 0; vertex < number.size(); ++vertex)
    if (number[vertex] != ~0u) order[number[vertex]] = vertex;
  MeshoptPrimitive result = with_vertices(from, order);
  for (uint32_t& index : indices) index = number[index];
  result.indices = std::move(indices);
  return result;
}

MeshoptPrimitive as_strip(const MeshoptPrimitive& from, std::span<const uint32_t> indices) {
  RailStrip strip = rail_strip(indices, from.lattice.size());
  MeshoptPrimitive result = with_vertices(from, strip.order);
  result.strip = std::move(strip.elements);
  return result;
}

template <class T>
std::span<const std::byte> bytes_of_vector(const std::vector<T>& values) {
  return std::as_bytes(std::span(values));
}

/// Each adds an accessor of the stored values and returns its number.
int add_positions(const std::vector<LatticePoint>& points, const PositionFrame& frame, MeshoptStreams& streams) {
  using Form = PositionFrame::Form;
  LatticePoint lo = points.front(), hi = lo;
  std::vector<int64_t> mantissas;
  std::vector<std::array<uint16_t, 4>> shorts;
  for (const LatticePoint& p : points) {
    std::array<uint16_t, 4> element{};
    for (size_t axis = 0; axis < 3; ++axis) {
      lo[axis] = std::min(lo[axis], p[axis]), hi[axis] = std::max(hi[axis], p[axis]);
      const int64_t stored = p[axis] - frame.origin[axis];
      if (frame.form == Form::kFloat)
        mantissas.push_back(stored);
      else
        element[axis] = static_cast<uint16_t>(stored);
    }
    if (frame.form != Form::kFloat) shorts.push_back(element);
  }
  GltfJson accessor{{"type", "VEC3"}};
  for (size_t axis = 0; axis < 3; ++axis) {
    accessor["min"].push_back(lo[axis] - frame.origin[axis]);
    accessor["max"].push_back(hi[axis] - frame.origin[axis]);
  }
  accessor["componentType"] = frame.form == Form::kFloat   ? kGltfFloat
                              : frame.form == Form::kShort ? kGltfShort
                                                           : kGltfUnsignedShort;
  if (frame.form == Form::kFloat)
    return streams.add({12, kGltfVertices, "EXPONENTIAL"}, exponential(mantissas, 0), std::move(accessor));
  return streams.add({8, kGltfVertices, {}}, bytes_of_vector(shorts), std::move(accessor));
}

int add_normals(const std::vector<std::array<int16_t, 4>>& codes, int bits, MeshoptStreams& streams) {
  const bool small = bits <= kByteBits;
  GltfJson accessor{{"type", "VEC3"}, {"componentType", small ? kGltfByte : kGltfShort}, {"normalized", true}};
  if (!small) return streams.add({8, kGltfVertices, "OCTAHEDRAL"}, bytes_of_vector(codes), std::move(accessor));
  std::vector<std::array<int8_t, 4>> bytes;
  bytes.reserve(codes.size());
  for (const auto& n : codes)
    bytes.push_back({static_cast<int8_t>(n[0]), static_cast<int8_t>(n[1]), static_cast<int8_t>(n[2]), 0});
  return streams.add({4, kGltfVertices, "OCTAHEDRAL"}, bytes_of_vector(bytes), std::move(accessor));
}

int add_uvs(const std::vector<std::array<float, 2>>& uvs, const UvGrid& grid, MeshoptStreams& streams) {
  const bool coded = grid.step > 0.0;
  GltfJson accessor{{"type", "VEC2"}, {"componentType", coded ? kGltfUnsignedShort : kGltfFloat}};
  if (!coded) return streams.add({8, kGltfVertices, {}}, bytes_of_vector(uvs), std::move(accessor));
  std::vector<std::array<uint16_t, 2>> codes;
  codes.reserve(uvs.size());
  for (const auto& uv : uvs) codes.push_back({static_cast<uint16_t>(uv[0]), static_cast<uint16_t>(uv[1])});
  return streams.add({4, kGltfVertices, {}}, bytes_of_vector(codes), std::move(accessor));
}

/// The primitive, with triangles and vertices ordered for the codec: as a list or as a strip, whichever is smaller.
MeshoptPrimitive ordered_for_codec(const MeshoptPrimitive& list, const PositionFrame& frame, int normal_bits,
                                   const UvGrid& uvs) {
  std::vector<uint32_t> indices(list.indices.size());
  meshopt_optimizeVertexCacheStrip(indices.data(), list.indices.data(), indices.size(), list.lattice.size());
  MeshoptPrimitive strip, ordered;
  uint64_t strip_bytes = 0, ordered_bytes = 0;
  const auto coded_bytes = [&](const MeshoptPrimitive& primitive) {
    GltfModel alone;
    MeshoptStreams streams(alone);
    add_meshopt_primitive(primitive, frame, normal_bits, uvs, streams);
    return streams.finish();
  };
  tbb::parallel_invoke(
      [&] {
        strip = as_strip(list, indices);
        strip_bytes = coded_bytes(strip);
      },
      [&] {
        ordered = as_list(list, indices);
        ordered_bytes = coded_bytes(ordered);
      });
  constexpr uint64_t kModeBytes = 9; // of "mode" in the document
  return strip_bytes + kModeBytes < ordered_bytes ? std::move(strip) : std::move(ordered);
}

/// Rounds the values of a primitive and merges equal vertices; triangles are a list in their order.
MeshoptPrimitive merged_primitive(const PlainPrimitive& plain, int normal_bits, const UvGrid& uvs, bool keep_uvs) {
  MeshoptPrimitive result;
  std::vector<StoredVertex> vertices =
      stored_vertices(plain, normal_bits, uvs, keep_uvs, result.max_normal_error_degrees);
  std::vector<unsigned> remap(vertices.size());
  std::vector<uint32_t> corners(plain.triangles.size() * 3);
  std::memcpy(corners.data(), plain.triangles.data(), corners.size() * sizeof(uint32_t));
  const size_t distinct = meshopt_generateVertexRemap(remap.data(), corners.data(), corners.size(), vertices.data(),
                                                      vertices.size(), sizeof(StoredVertex));
  std::vector<StoredVertex> merged(distinct);
  meshopt_remapVertexBuffer(merged.data(), vertices.data(), vertices.size(), sizeof(StoredVertex), remap.data());
  result.indices.reserve(corners.size());
  for (size_t i = 0; i < corners.size(); i += 3) {
    const uint32_t a = remap[corners[i]], b = remap[corners[i + 1]], c = remap[corners[i + 2]];
    if (a == b || b == c || a == c)
      ++result.collapsed_triangles;
    else
      result.indices.insert(result.indices.end(), {a, b, c});
  }
  result.triangles = result.indices.size() / 3;
  for (const StoredVertex& vertex : merged) {
    result.lattice.push_back(vertex.lattice);
    if (!plain.normals.empty()) result.normals.push_back(vertex.normal);
    if (keep_uvs && !plain.uvs.empty()) result.uvs.push_back(vertex.uv);
  }
  return result;
}

} // namespace

std::optional<PositionFrame> position_frame(const LatticePoint& lo, const LatticePoint& hi) {
  using Form = PositionFrame::Form;
  const auto fits = [&](int64_t least, int64_t most) {
    return std::ranges::all_of(lo, [&](int64_t q) { return q >= least; }) &&
           std::ranges::all_of(hi, [&](int64_t q) { return q <= most; });
  };
  int64_t extent = 0;
  for (size_t axis = 0; axis < 3; ++axis) extent = std::max(extent, hi[axis] - lo[axis]);
  if (fits(std::numeric_limits<int16_t>::min(), std::numeric_limits<int16_t>::max()))
    return PositionFrame{Form::kShort, {}};
  if (extent <= std::numeric_limits<uint16_t>::max()) return PositionFrame{Form::kUnsignedShort, lo};
  if (fits(-kMaxMantissa, kMaxMantissa)) return PositionFrame{Form::kFloat, {}};
  if (extent > kMaxMantissa) return std::nullopt;
  return PositionFrame{Form::kFloat, lo};
}

MeshoptPrimitive meshopt_primitive(const PlainPrimitive& plain, const PositionFrame& frame, int normal_bits,
                                   const UvGrid& uvs, bool keep_uvs) {
  MeshoptPrimitive merged = merged_primitive(plain, normal_bits, uvs, keep_uvs);
  return merged.triangles == 0 ? merged : ordered_for_codec(merged, frame, normal_bits, uvs);
}

GltfJson add_meshopt_primitive(const MeshoptPrimitive& primitive, const PositionFrame& frame, int normal_bits,
                               const UvGrid& uvs, MeshoptStreams& streams) {
  GltfJson attributes{{"POSITION", add_positions(primitive.lattice, frame, streams)}};
  if (!primitive.normals.empty()) attributes["NORMAL"] = add_normals(primitive.normals, normal_bits, streams);
  if (!primitive.uvs.empty()) attributes["TEXCOORD_0"] = add_uvs(primitive.uvs, uvs, streams);
  GltfJson result{{"attributes", std::move(attributes)}};
  if (primitive.strip.empty()) {
    result["indices"] = streams.add_indices(primitive.indices, primitive.lattice.size());
  } else {
    result["indices"] = streams.add_strip(primitive.strip, primitive.lattice.size());
    result["mode"] = kGltfTriangleStrip;
  }
  return result;
}

} // namespace packtrace
