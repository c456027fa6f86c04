#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compress/format/pages/page_codec.h"
#include "pbrt_import/scene/scene.h"
#include "tests/benchmarks/packing_benchmark_mesh.h"

namespace packtrace {

/// Lattice to which a codec may round positions: |decoded - source| <= step / 2 per axis, plus float rounding.
struct PackingPrecision {
  std::string name; ///< "p14": the longest side / (2^14 - 1); "edge/128": the median edge / 128
  double step = 0.0;
};

/// Errors of decoded data against the source; maxima over all vertices unless stated otherwise.
struct PackingErrors {
  double position = 0.0; ///< largest over the axes, object units
  std::optional<double> normal_max_degrees, normal_mean_degrees;
  std::optional<double> uv;    ///< larger of the two axes
  uint64_t lost_triangles = 0; ///< source triangles missing from the decoded mesh
};

/// A way to pack a mesh. Not thread-safe.
class PackingCodec {
public:
  virtual ~PackingCodec() = default;
  virtual std::string name() const = 0;
  /// False if the codec has no lattice and keeps floats unchanged.
  virtual bool rounds() const { return true; }
  /// Packs the mesh and keeps the encoded data for decode(). Returns its size in bytes.
  virtual size_t encode(const Mesh& mesh, const PackingPrecision& precision) = 0;
  /// Unpacks the encoded data into plain arrays, whose memory is reused. The arrays are kept for errors().
  virtual void decode() = 0;
  /// Whether the codec needs open() before decode(): a separate step that checks the whole file once and makes its
  /// clusters readable.
  virtual bool has_open() const { return false; }
  virtual void open() {}
  /// Errors of the last encode() and decode().
  virtual PackingErrors errors(const Mesh& source, const PackingPrecision& precision) = 0;
};

/// Uncompressed: float positions, normals and UVs; 32-bit indices.
std::unique_ptr<PackingCodec> raw_codec();

/// Fixed-size vertices: position 3 x 16 bits (32 if the step requires it), octahedral normal 2 x 16 bits and UV 2 x 16
/// bits; 32-bit indices. Without normals and UVs, positions are padded to 8 (16) bytes.
/// @param zstd_level 0: not compressed
std::unique_ptr<PackingCodec> fixed_vertex_codec(int zstd_level);

/// The same vertices, reordered for the vertex cache, encoded with meshoptimizer's vertex and index codecs and zstd.
std::unique_ptr<PackingCodec> meshopt_codec(int zstd_level);

/// Draco's edgebreaker at compression level 10, with explicit quantisation at the step; 12 bits for normals, 14 for
/// UVs.
std::unique_ptr<PackingCodec> draco_codec();

/// Options of this project's file.
struct PacktraceFile {
  PageCodec codec = PageCodec::kNone;
  /// Keep UVs as for a mask of 1024 x 1024 texels over [0,1]^2; otherwise none, as in scenes without masks.
  bool keep_uvs = false;
  bool trees = false; ///< store trees for tracing; no other codec here has them
};
std::unique_ptr<PackingCodec> packtrace_codec(const PacktraceFile& wanted);

/// Angle between two directions in degrees.
double angle_degrees(Vec3 a, Vec3 b);

} // namespace packtrace
