#include "compress/bake/plan/equal_meshes.h"

#include <array>
#include <cstring>
#include <map>
#include <utility>

#include <tbb/parallel_for.h>
#include <xxhash.h>

namespace packtrace {
namespace {

template <typename T>
size_t byte_size(const std::vector<T>& v) {
  return v.size() * sizeof(T);
}

template <typename T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), byte_size(a)) == 0);
}

bool same_content(const Mesh& a, const Mesh& b) {
  return same_bytes(a.positions, b.positions) && same_bytes(a.normals, b.normals) && same_bytes(a.uvs, b.uvs) &&
         same_bytes(a.triangles, b.triangles);
}

std::pair<uint64_t, uint64_t> content_hash(const Mesh& mesh) {
  const auto hash = [](const auto& v) { return XXH3_128bits(v.data(), byte_size(v)); };
  const std::array<XXH128_hash_t, 4> parts = {hash(mesh.positions), hash(mesh.normals), hash(mesh.uvs),
                                              hash(mesh.triangles)};
  const XXH128_hash_t all = XXH3_128bits(parts.data(), sizeof parts);
  return {all.high64, all.low64};
}

} // namespace

std::vector<uint32_t> first_equal_meshes(const Scene& scene) {
  std::vector<std::pair<uint64_t, uint64_t>> hashes(scene.meshes.size());
  tbb::parallel_for(size_t{0}, hashes.size(), [&](size_t i) { hashes[i] = content_hash(scene.meshes[i]); });
  std::map<std::pair<uint64_t, uint64_t>, uint32_t> first_with;
  std::vector<uint32_t> result(hashes.size());
  for (uint32_t i = 0; i < result.size(); ++i) {
    const uint32_t first = first_with.try_emplace(hashes[i], i).first->second;
    result[i] = same_content(scene.meshes[first], scene.meshes[i]) ? first : i;
  }
  return result;
}

} // namespace packtrace
