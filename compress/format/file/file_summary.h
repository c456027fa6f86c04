#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/file/lod_summary.h"
#include "compress/format/motion/motion_summary.h"
#include "compress/format/voxels/proxy_codec.h"

namespace packtrace {

/// Size of each part of a file in bytes. The payload's streams share bytes; each is rounded up to whole bytes.
struct StreamBytes {
  uint64_t indices = 0, positions = 0, normals = 0, uvs = 0;
  uint64_t payload_padding = 0;
  uint64_t cluster_records = 0, geometry_records = 0, instance_records = 0, material_records = 0;
  uint64_t masks = 0, textures = 0, cameras = 0, strings = 0, requirement_records = 0;
  /// Level, group and link records. The other members count the records and streams of all levels.
  uint64_t lod_records = 0;
  uint64_t trees = 0; ///< tree records and nodes
  uint64_t rigid_motion = 0, deformation = 0;
  uint64_t shading_materials = 0, lights = 0, environment_maps = 0; ///< only in files baked for shading
  uint64_t proxies = 0;
  uint64_t header_and_alignment = 0; ///< includes the summary record
  uint64_t total = 0;                ///< of the file
};

/// A position grid and the number of geometries that use it.
struct GridUse {
  PositionGrid grid;
  bool world_space = false;
  uint32_t geometries = 0;
};

/// A normal encoding and its use.
struct NormalUse {
  NormalEncoding encoding;
  uint32_t geometries = 0;     ///< geometries that store normals
  uint64_t vertices = 0;       ///< vertices with a normal, summed over clusters
  float max_error_degrees = 0; ///< measured; includes inferred face normals, which are not stored
};

/// Contents of a geometry, with the reasons for its streams (GeometryRecord::requirements).
struct GeometryUse {
  std::string name;
  uint32_t requirements = 0, slots = 0;
  uint64_t instances = 0, triangles = 0;
  uint64_t normal_triangles = 0, uv_triangles = 0; ///< triangles of clusters that store the stream
  uint64_t normal_bits = 0, uv_bits = 0;
};

/// An encoding of texture coordinates and its use.
struct UvUse {
  UvEncoding encoding;
  uint32_t geometries = 0; ///< geometries that store texture coordinates
  uint64_t vertices = 0;   ///< vertices with texture coordinates, summed over clusters
  float max_error = 0;     ///< measured, larger axis
  /// Upper bound: largest product of a geometry's error and the size of its finest texture.
  double max_error_texels = 0;
};

struct TextureUse {
  std::string name;
  uint32_t width = 0, height = 0;
  TextureCodec codec = TextureCodec::kRgb8;
  uint64_t bytes = 0;
  float psnr_db = 0; ///< infinite if lossless
};

/// The frames of a geometry that deforms.
struct SequenceUse {
  std::string name; ///< of the geometry
  uint32_t frames = 0, group_frames = 0;
  double frames_per_second = 0.0;
  int64_t first_number = 0;
  uint64_t source_vertices = 0; ///< per frame
  uint64_t bytes = 0;           ///< of all frames, without tables
  double max_position_error = 0.0;

  double bytes_per_vertex() const { ///< and frame
    return static_cast<double>(bytes) / (static_cast<double>(source_vertices) * frames);
  }
};

/// Geometries that replace each other by distance.
struct LevelChainUse {
  std::vector<std::string> names; ///< of the geometries, fine to coarse
  std::vector<double> distances;  ///< world units, one less
  uint64_t instances = 0;
};

/// A proxy, see proxy_format.h.
struct ProxySummary {
  std::string name; ///< of the geometry
  uint32_t kind = 0, flags = 0, swatches = 0;
  VoxelIndex size{};
  double edge = 0.0, surface_error = 0.0, voxel_error = 0.0;
  uint64_t voxels = 0;        ///< occupied; of a field: 0
  uint64_t stored_voxels = 0; ///< whose bits are stored: less with shared nodes or full cells; of a field: samples
  uint64_t bits = 0, index_bits = 0; ///< without the header
};

/// Report of `info` about a baked file. Counts of geometries, triangles and so on are those of level 0; bytes include
/// all levels.
struct FileSummary {
  uint64_t triangles = 0, placed_triangles = 0, vertices = 0, placed_vertices = 0, clusters = 0;
  uint64_t lights = 0, area_light_materials = 0; ///< only in files baked for shading
  uint64_t geometries = 0, shared_geometries = 0, instances = 0, materials = 0, masks = 0, cameras = 0;
  StreamBytes bytes; ///< of the resident file (codec none)
  DiskForm disk;
  double bytes_per_triangle = 0.0; ///< whole file over stored triangles of level 0; 0 without triangles
  double bytes_per_placed_triangle = 0.0;
  double triangles_per_cluster = 0.0;
  std::vector<GridUse> grids;     ///< world space first, then from the finest step to the coarsest
  std::vector<NormalUse> normals; ///< ordered by encoding
  std::vector<TextureUse> textures;
  std::vector<UvUse> uvs; ///< ordered by encoding
  std::vector<SequenceUse> sequences;
  std::vector<LevelChainUse> level_chains;
  std::vector<ProxySummary> proxies;
  LodSummary lod;
  MotionSummary motion;
  uint64_t trees = 0, nodes = 0;   ///< of all levels
  uint32_t tree_depth = 0;         ///< levels of nodes in the deepest tree
  double max_position_error = 0.0; ///< measured, largest axis, object units, maximum over all geometries
  double max_position_error_bound = 0.0;
  float max_normal_error_degrees = 0.0f;
  float max_uv_error = 0.0f;
  std::vector<baked::RequirementRecord> requirements; ///< decisions about streams, with their reasons
  std::vector<GeometryUse> by_geometry;
  MaterialFlags material_flags = 0; ///< union over the materials in use
  uint64_t materials_in_use = 0;    ///< materials that some slot of an instance references
  uint32_t max_slots = 0;           ///< maximum number of material slots of one geometry
  Bounds bounds;                    ///< world space
  baked::SummaryRecord bake{};      ///< settings and counts of the bake
};

FileSummary summarize(const BakedFile& file);

} // namespace packtrace
