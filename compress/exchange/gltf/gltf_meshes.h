#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "compress/exchange/gltf/gltf_export.h"
#include "compress/exchange/gltf/gltf_materials.h"
#include "compress/exchange/gltf/meshopt_primitive.h"
#include "compress/exchange/gltf/meshopt_streams.h"
#include "compress/exchange/gltf/plain_primitives.h"

namespace packtrace {

/// Extras of a mesh or an asset whose positions are integers: their lattice, in steps of 1.
GltfJson gltf_integer_lattice();

/// Step of a geometry's lattice, object units.
double lattice_step(const baked::GeometryRecord& geometry);

/// Bounds on a lattice.
struct GltfLatticeBox {
  LatticePoint lo{}, hi{};
  bool empty = true;
  void extend(const LatticePoint& p);
  void extend(const GltfLatticeBox& box);
  /// Bits per axis for codes that count from lo, at least 1.
  int bits() const;
};

/// A primitive, encoded but not yet added to the model.
struct GltfPrimitive {
  PlainPrimitive plain;
  std::optional<DracoPrimitive> draco;
  std::optional<MeshoptPrimitive> meshopt; ///< if set, `plain` keeps only its material slot
};

/// The primitives of a geometry, and how they are stored.
struct GltfGeometry {
  std::vector<GltfPrimitive> primitives;
  GltfLatticeBox box;
  std::optional<PositionFrame> frame; ///< codec meshopt: of positions as integers; none: they are floats
  bool with_uvs = true;               ///< some instance has a material with an image
};

/// Draco grids of all geometries. World-space geometries with equal steps lie on one lattice and share a grid, so that
/// touching surfaces decode to equal positions.
class DracoGrids {
public:
  void add(const baked::GeometryRecord& geometry, uint32_t number, const GltfLatticeBox& box);
  DracoGrid grid(const baked::GeometryRecord& geometry, uint32_t number) const;

private:
  using Key = std::pair<double, uint32_t>;
  static Key key(const baked::GeometryRecord& geometry, uint32_t number);
  std::map<Key, GltfLatticeBox> boxes_;
};

/// Adds geometries to a model as glTF meshes.
class GltfMeshes {
public:
  GltfMeshes(const BakedFile& file, const GltfConfig& config, const GltfMaterials& materials, const UvGrid& uvs,
             GltfModel& model, GltfReport& report)
      : file_(file), config_(config), materials_(materials), uvs_(uvs), model_(model), streams_(model),
        report_(report) {}

  void add_geometry(uint32_t geometry, GltfGeometry&& from);
  /// Returns the mesh of a geometry with the materials of an instance; meshes of one geometry share its buffers. None
  /// if the geometry has no triangles.
  std::optional<int> mesh_of(uint32_t geometry, uint32_t first_slot);
  /// Map from a mesh's stored positions to object space: the identity unless they are integers.
  const DAffine& object_from_stored(uint32_t geometry) const { return frames_[geometry]; }

  /// Adds a mesh of primitives in world space that have the same lattice, merged by material; the codec is meshopt.
  /// @param geometries each of one instance at the identity
  struct Placed {
    uint32_t geometry, first_slot;
    GltfGeometry* encoded;
  };
  void add_world(std::vector<Placed>&& geometries, Progress& progress);

  /// Nodes that add_world() made, without a parent.
  const std::vector<int>& world_nodes() const { return world_nodes_; }

  MeshoptStreams& streams() { return streams_; }
  void finish() { report_.geometry_bytes += streams_.finish(); }

private:
  struct Template {
    uint32_t material_slot = 0;
    GltfJson primitive;    ///< without a material
    std::vector<Vec2> uvs; ///< coordinates that materials may map
    bool mapped = false;   ///< whether TEXCOORD_0 is added per material
  };
  struct Batch {
    PlainPrimitive plain;
    GltfLatticeBox box;
    PositionFrame frame; ///< of the box
    MeshoptPrimitive coded;
  };

  Template add_plain(PlainPrimitive&& plain);
  Template add_draco(const GltfPrimitive& from);
  void add_meshopt(uint32_t geometry, GltfGeometry&& from);
  void add_batch(const Batch& batch, double step, int material);
  GltfJson add_coded(const MeshoptPrimitive& coded, const PositionFrame& frame);
  int add_floats(std::span<const float> values, const char* type);
  int add_indices(const std::vector<Triangle>& triangles, size_t vertices);
  int mapped_uvs(uint32_t geometry, size_t part, const UvMap& map);

  const BakedFile& file_;
  const GltfConfig& config_;
  const GltfMaterials& materials_;
  const UvGrid uvs_;
  GltfModel& model_;
  MeshoptStreams streams_;
  GltfReport& report_;
  std::vector<std::vector<Template>> templates_; ///< by geometry
  std::vector<DAffine> frames_;                  ///< by geometry
  std::vector<bool> integers_;                   ///< by geometry: whether positions are stored as integers
  std::vector<int> world_nodes_;
  std::map<std::pair<uint32_t, uint32_t>, int> meshes_;
  std::map<std::tuple<uint32_t, size_t, double, double, double, double>, int> mapped_;
};

} // namespace packtrace
