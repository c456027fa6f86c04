#include "pbrt_import/shapes/heightfield.h"

#include <limits>
#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {

Mesh make_heightfield(uint32_t nu, uint32_t nv, std::span<const float> heights) {
  if (nu < 2 || nv < 2) throw Error(ErrorKind::kInput, "a heightfield needs nu and nv of at least 2");
  if (uint64_t{nu} * nv != heights.size() || heights.size() > std::numeric_limits<uint32_t>::max())
    throw Error(ErrorKind::kInput, "the heightfield has " + std::to_string(heights.size()) + " heights for " +
                                       std::to_string(nu) + " x " + std::to_string(nv) + " samples");
  Mesh mesh;
  mesh.positions.reserve(heights.size());
  mesh.uvs.reserve(heights.size());
  for (uint32_t y = 0; y < nv; ++y) {
    for (uint32_t x = 0; x < nu; ++x) {
      const Vec2 uv(static_cast<float>(x) / static_cast<float>(nu - 1),
                    static_cast<float>(y) / static_cast<float>(nv - 1));
      mesh.uvs.push_back(uv);
      mesh.positions.emplace_back(uv, heights[size_t{y} * nu + x]);
    }
  }
  mesh.triangles.reserve(2 * size_t{nu - 1} * (nv - 1));
  for (uint32_t y = 0; y + 1 < nv; ++y) {
    for (uint32_t x = 0; x + 1 < nu; ++x) {
      const uint32_t a = y * nu + x, b = a + 1, c = b + nu, d = a + nu;
      mesh.triangles.emplace_back(a, b, c);
      mesh.triangles.emplace_back(a, c, d);
    }
  }
  return mesh;
}

} // namespace packtrace
