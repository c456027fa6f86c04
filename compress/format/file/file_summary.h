#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/file/lod_summary.h"

namespace packtrace {

/// Where the bytes of a file go. The payload's streams share bytes; each is rounded to whole bytes for the total.
struct StreamBytes {
  uint64_t indices = 0, positions = 0, normals = 0, uvs = 0;
  uint64_t payload_padding = 0;
  uint64_t cluster_records = 0, geometry_records = 0, instance_records = 0, material_records = 0;
  uint64_t masks = 0, textures = 0, cameras = 0, strings = 0, requirement_records = 0;
  uint64_t lod_records = 0;          ///< levels, groups and links; other records and streams are of all levels
  uint64_t trees = 0;                ///< records and nodes
  uint64_t header_and_alignment = 0; ///< with the summary record
  uint64_t total = 0;                ///< of the file
};

/// One position grid in use.
struct GridUse {
  PositionGrid grid;
  bool world_space = false;
  uint32_t geometries = 0;
};

/// One encoding of normals in use.
struct NormalUse {
  NormalEncoding encoding;
  uint32_t geometries = 0;     ///< that store normals
  uint64_t vertices = 0;       ///< with a normal, sum over clusters
  float max_error_degrees = 0; ///< measured, flat normals that are not stored included
};

/// What a geometry holds, and why (GeometryRecord::requirements).
struct GeometryUse {
  std::string name;
  uint32_t requirements = 0, slots = 0;
  uint64_t instances = 0, triangles = 0;
  uint64_t normal_triangles = 0, uv_triangles = 0; ///< in clusters that store them
  uint64_t normal_bits = 0, uv_bits = 0;
};

/// One encoding of texture coordinates in use.
struct UvUse {
  UvEncoding encoding;
  uint32_t geometries = 0;     ///< that store texture coordinates
  uint64_t vertices = 0;       ///< with one, sum over clusters
  float max_error = 0;         ///< measured, larger axis
  double max_error_texels = 0; ///< a bound: the largest error of a geometry times its finest texture's larger side
};

/// One texture.
struct TextureUse {
  std::string name;
  uint32_t width = 0, height = 0;
  TextureCodec codec = TextureCodec::kRgb8;
  uint64_t bytes = 0;
  float psnr_db = 0; ///< infinite where nothing was lost
};

/// What `info` shows of a baked file. Geometries, triangles and so on are those of level 0; bytes are of all levels.
struct FileSummary {
  uint64_t triangles = 0, placed_triangles = 0, vertices = 0, placed_vertices = 0, clusters = 0;
  uint64_t geometries = 0, shared_geometries = 0, instances = 0, materials = 0, masks = 0, cameras = 0;
  StreamBytes bytes; ///< with codec none
  DiskForm disk;
  double bytes_per_triangle = 0.0; ///< whole file over stored triangles; 0 without triangles
  double bytes_per_placed_triangle = 0.0;
  double triangles_per_cluster = 0.0;
  std::vector<GridUse> grids;     ///< world space first, then by step, finest first
  std::vector<NormalUse> normals; ///< by encoding
  std::vector<TextureUse> textures;
  std::vector<UvUse> uvs; ///< by encoding
  LodSummary lod;
  uint64_t trees = 0, nodes = 0; ///< of all levels
  uint32_t tree_depth = 0;       ///< of the deepest tree, in nodes
  double max_position_error = 0.0; ///< measured, largest axis, object units, over all geometries
  double max_position_error_bound = 0.0;
  float max_normal_error_degrees = 0.0f;
  float max_uv_error = 0.0f;
  std::vector<baked::RequirementRecord> requirements; ///< what was decided about streams, and why
  std::vector<GeometryUse> by_geometry;
  MaterialFlags material_flags = 0; ///< of materials in use
  uint64_t materials_in_use = 0;    ///< by some triangle
  uint32_t max_slots = 0;           ///< most materials of one geometry
  Bounds bounds;                    ///< world
  baked::SummaryRecord bake{};      ///< settings and counts of the bake
};

FileSummary summarize(const BakedFile& file);

} // namespace packtrace
