#include <algorithm>
#include <cstdlib>
#include <limits>

#include "compress/bake/page_fast_encoder.h"

namespace packtrace {

using namespace page_fast;

namespace {

constexpr int64_t kNothing = std::numeric_limits<int64_t>::min();

} // namespace

size_t FastPageWriter::VertexHash::operator()(const VertexKey& key) const {
  uint64_t hash = 0;
  for (const int64_t part : key) {
    hash = (hash ^ static_cast<uint64_t>(part)) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  }
  return static_cast<size_t>(hash);
}

FastPageWriter::VertexKey FastPageWriter::key_of(const ClusterView& view, uint32_t vertex, bool with_normal) const {
  VertexKey key;
  key.fill(kNothing);
  const LatticePoint point = view.lattice(vertex);
  std::copy(point.begin(), point.end(), key.begin());
  const auto absolute = [&](uint32_t channel, uint32_t field) {
    const uint64_t value = field_of(layouts_[channel], vertices_[vertex].words[channel], field);
    return static_cast<int64_t>(static_cast<uint32_t>(value) + layouts_[channel].base[field]);
  };
  if (with_normal) {
    key[3] = view.record().flags & (baked::kClusterMixedCharts | baked::kClusterChart);
    for (uint32_t i = 0; i < 3; ++i) key[4 + i] = absolute(kNormals, i);
  }
  if (view.has_uvs()) key[7] = absolute(kUvs, 0), key[8] = absolute(kUvs, 1);
  return key;
}

void FastPageWriter::find_sources(const ClusterView& view) {
  const baked::ClusterRecord& record = view.record();
  if (layouts_[kPositions].verbatim()) return;
  const bool with_normals = view.has_normals() && record.normal_palette == 0;
  const bool narrow = *std::ranges::max_element(record.position_bits) <= 32;
  std::unordered_map<VertexKey, uint32_t, VertexHash> places;
  uint32_t creases = 0, imports = 0, import = last_import_;
  for (uint32_t v = 0; v < vertices_.size(); ++v) {
    VertexKey place{};
    std::ranges::copy(view.lattice(v), place.begin());
    const auto crease = places.find(place);
    if (v > 0 && narrow) {
      const auto found = page_vertices_.find(key_of(view, v, with_normals));
      const int64_t distance =
          found == page_vertices_.end() ? 0 : static_cast<int64_t>(found->second) - static_cast<int64_t>(import);
      if (found != page_vertices_.end() && imports < 255 && std::abs(distance) < 1 << 15 &&
          (with_normals || crease == places.end())) {
        vertices_[v].source = Source::kImport;
        vertices_[v].original = import = found->second;
        ++imports;
      }
    }
    if (vertices_[v].source == Source::kNew && crease != places.end() && creases < 255) {
      vertices_[v].source = Source::kCrease;
      vertices_[v].original = crease->second;
      ++creases;
    }
    places[place] = v;
  }
  // Few of them are not worth a bit a vertex.
  const auto drop = [&](Source source, uint32_t& count, uint32_t least) {
    if (count * least >= vertices_.size()) return;
    for (Vertex& vertex : vertices_)
      if (vertex.source == source) vertex.source = Source::kNew;
    count = 0;
  };
  drop(Source::kCrease, creases, 16);
  drop(Source::kImport, imports, 24);
  header_.creases = static_cast<uint8_t>(creases);
  header_.imports = static_cast<uint8_t>(imports);
}

/// Later clusters may import the vertices.
void FastPageWriter::remember(const ClusterView& view) {
  const bool with_normals = view.has_normals() && view.record().normal_palette == 0;
  const bool narrow = *std::ranges::max_element(view.record().position_bits) <= 32 && !layouts_[kPositions].verbatim();
  for (uint32_t v = 0; v < vertices_.size(); ++v, ++page_vertex_count_) {
    if (!narrow) continue;
    page_vertices_[key_of(view, v, false)] = page_vertex_count_;
    if (with_normals) page_vertices_[key_of(view, v, true)] = page_vertex_count_;
  }
}

} // namespace packtrace
