#include "compress/exchange/gltf/plain_primitives.h"

#include <array>
#include <bit>
#include <unordered_map>

namespace packtrace {
namespace {

/// All stored values of a vertex; equal keys are merged.
struct VertexKey {
  LatticePoint position{};
  uint32_t normal = 0;
  std::array<int64_t, 2> uv{};
  bool operator==(const VertexKey&) const = default;
};

struct HashVertex {
  size_t operator()(const VertexKey& key) const {
    uint64_t h = key.normal;
    for (const int64_t word : {key.position[0], key.position[1], key.position[2], key.uv[0], key.uv[1]})
      h = (std::rotl(h, 29) ^ static_cast<uint64_t>(word)) * 0x9e3779b97f4a7c15u;
    return h ^ (h >> 32);
  }
};

struct OpenPrimitive {
  PlainPrimitive result;
  std::unordered_map<VertexKey, uint32_t, HashVertex> known;
};

uint32_t vertex_number(OpenPrimitive& to, const ClusterView& view, uint32_t v) {
  VertexKey key;
  key.position = view.lattice(v);
  if (view.has_normals()) key.normal = view.normal_code(v);
  if (view.has_uvs()) key.uv = view.uv_code(v);
  PlainPrimitive& out = to.result;
  const auto [place, added] = to.known.try_emplace(key, static_cast<uint32_t>(out.lattice.size()));
  if (added) {
    out.lattice.push_back(key.position);
    out.positions.push_back(view.position(v));
    if (view.has_normals()) out.normals.push_back(view.normal(v));
    if (view.has_uvs()) out.uvs.push_back(view.uv(v));
  }
  return place->second;
}

} // namespace

void append(PlainPrimitive& to, PlainPrimitive&& from) {
  if (to.lattice.empty()) {
    to = std::move(from);
    return;
  }
  const auto base = static_cast<uint32_t>(to.lattice.size());
  const auto join = [](auto& all, const auto& more) { all.insert(all.end(), more.begin(), more.end()); };
  join(to.lattice, from.lattice);
  join(to.positions, from.positions);
  join(to.normals, from.normals);
  join(to.uvs, from.uvs);
  for (const Triangle& t : from.triangles) to.triangles.push_back(t + base);
}

std::vector<PlainPrimitive> plain_primitives(const BakedFile& file, uint32_t geometry) {
  std::vector<OpenPrimitive> open;
  std::unordered_map<uint64_t, size_t> by_kind;
  const uint32_t clusters = file.geometries()[geometry].cluster_count;
  for (uint32_t c = 0; c < clusters; ++c) {
    const ClusterView view = file.cluster(geometry, c);
    const uint64_t kind = (uint64_t{view.material_slot()} << 2) | (view.has_normals() ? 2u : 0u) | view.has_uvs();
    const auto [place, added] = by_kind.try_emplace(kind, open.size());
    if (added) open.emplace_back().result.material_slot = view.material_slot();
    OpenPrimitive& to = open[place->second];
    std::array<uint32_t, kMaxClusterVertices> numbers;
    for (uint32_t v = 0; v < view.vertex_count(); ++v) numbers[v] = vertex_number(to, view, v);
    for (uint32_t i = 0; i < view.triangle_count(); ++i) {
      const Triangle t = view.triangle(i);
      to.result.triangles.emplace_back(numbers[t.x], numbers[t.y], numbers[t.z]);
    }
  }
  std::vector<PlainPrimitive> result;
  result.reserve(open.size());
  for (OpenPrimitive& primitive : open) result.push_back(std::move(primitive.result));
  return result;
}

} // namespace packtrace
