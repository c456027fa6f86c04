#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// The frames of one mesh of a scene, which differ in positions only.
class MeshFrames {
public:
  virtual ~MeshFrames() = default;

  virtual uint32_t count() const = 0;
  /// Positions in a frame, in the order of Mesh::positions, all finite.
  /// Throws Error(kInput) if the frame cannot be read or has another topology than frame 0.
  virtual std::vector<Vec3> positions(uint32_t frame) const = 0;
  /// Names a frame in messages.
  virtual std::string name(uint32_t frame) const = 0;
};

/// A mesh of a scene that moves.
struct MeshSequence {
  uint32_t mesh = 0; ///< index into Scene::meshes, which hold frame 0
  std::shared_ptr<const MeshFrames> frames;
  double frames_per_second = 24.0; ///< finite, positive
  int64_t first_number = 0;        ///< number of frame 0 in the names of its files
};

} // namespace packtrace
