#pragma once

#include <array>
#include <optional>
#include <set>

#include "compress/format/file/baked_file.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {

using WorldFace = std::array<std::array<float, 3>, 3>;

/// Faces of all instances in world space, each beginning with its smallest corner.
/// @param mirroring only of instances that mirror, or do not
/// @param not_instanced only of geometries in world space
inline std::multiset<WorldFace> world_faces(const BakedFile& file, std::optional<bool> mirroring = std::nullopt,
                                            bool not_instanced = false) {
  std::multiset<WorldFace> faces;
  for (uint32_t i = 0; i < file.instances().size(); ++i) {
    if (not_instanced && (file.geometries()[file.instances()[i].geometry].flags & baked::kWorldSpace) == 0) continue;
    const Decoded decoded = decode(file, file.instances()[i].geometry);
    const DAffine map(file.world_from_object(i));
    if (mirroring && swaps_handedness(map) != *mirroring) continue;
    for (const Triangle& t : decoded.triangles) {
      WorldFace face;
      for (int k = 0; k < 3; ++k) {
        const DVec3 p = transform_point(map, DVec3(decoded.positions[t[k]]));
        for (int axis = 0; axis < 3; ++axis) // + 0 turns -0 into 0
          face[static_cast<size_t>(k)][static_cast<size_t>(axis)] = static_cast<float>(p[axis]) + 0.0f;
      }
      faces.insert(face_of(face));
    }
  }
  return faces;
}

} // namespace packtrace::test
