#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "compress/exchange/gltf/meshopt_streams.h"
#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Translation, rotation and scale of an instance, as EXT_mesh_gpu_instancing stores them.
struct InstanceTransform {
  std::array<float, 3> translation{};
  std::array<float, 4> rotation{0, 0, 0, 1}; ///< unit quaternion x, y, z, w
  std::array<float, 3> scale{1, 1, 1};       ///< x is negative if the map mirrors
};

/// Decomposes a map; none if it shears or flattens, so that the decomposition would move a point of the unit ball by
/// more than 4e-6 of the map's size.
std::optional<InstanceTransform> decompose_instance(const DAffine& map);

/// Attributes of EXT_mesh_gpu_instancing for the instances of a mesh. All maps must decompose.
class InstanceAttributes {
public:
  explicit InstanceAttributes(std::span<const DAffine> world_from_stored);

  /// Adds floats to the attributes; returns their bytes.
  uint64_t add_floats(GltfModel& model, GltfJson& attributes) const;

  /// Adds values that are rounded so that no point of the mesh moves by more than about half a stored unit, or floats
  /// where sizes or distances differ too much for that, and returns
  /// the largest distance that a corner of the box moves, in world units. Changes the order of the instances.
  /// @param stored bounds of the mesh, in units of the lattice's step
  double add_coded(const Bounds& stored, MeshoptStreams& streams, GltfJson& attributes);

private:
  void sort();
  double displacement(const std::vector<InstanceTransform>& rounded, const Bounds& stored) const;
  /// An attribute as a stream stores it.
  struct Coded {
    MeshoptStreams::Format format;
    std::vector<std::byte> bytes;
    GltfJson accessor;
  };
  Coded code_rotations(const Bounds& stored, double tolerance, std::vector<InstanceTransform>& rounded) const;

  std::vector<DAffine> maps_;
  std::vector<InstanceTransform> transforms_;
};

} // namespace packtrace
