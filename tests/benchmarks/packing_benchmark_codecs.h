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

/// The lattice a codec may round positions to: |decoded - source| <= step / 2 per axis, floats' own rounding apart.
struct PackingPrecision {
  std::string name; ///< "p14": the longest side / (2^14 - 1); "edge/128": the median edge / 128
  double step = 0.0;
};

/// What a decoder gave back, against its source; largest over all vertices.
struct PackingErrors {
  double position = 0.0; ///< largest axis, object units
  std::optional<double> normal_max_degrees, normal_mean_degrees;
  std::optional<double> uv;    ///< largest axis
  uint64_t lost_triangles = 0; ///< of the source, not in what was decoded
};

/// A way to pack a mesh. Not for several threads at a time.
class PackingCodec {
public:
  virtual ~PackingCodec() = default;
  virtual std::string name() const = 0;
  /// False where the codec has no lattice: it keeps floats as they are.
  virtual bool rounds() const { return true; }
  /// Packs the mesh and keeps what encoding gave, ready for decode(). Returns its size in bytes.
  virtual size_t encode(const Mesh& mesh, const PackingPrecision& precision) = 0;
  /// Unpacks what encode() made into plain arrays that stay allocated; the arrays are kept for errors().
  virtual void decode() = 0;
  /// Where a codec checks its whole file once, and makes its clusters readable, apart from decoding: that step, needed
  /// before decode().
  virtual bool has_open() const { return false; }
  virtual void open() {}
  /// Of the last encode() and decode().
  virtual PackingErrors errors(const Mesh& source, const PackingPrecision& precision) = 0;
};

/// float positions, normals and uvs as they are, indices of 32 bits.
std::unique_ptr<PackingCodec> raw_codec();

/// Position 3 x 16 bits (32 where the step asks for it), octahedral normal 2 x 16 and uv 2 x 16 bits; indices of 32
/// bits. Without normals and uvs positions are padded to 8 (16) bytes.
/// @param zstd_level 0: not compressed
std::unique_ptr<PackingCodec> fixed_vertex_codec(int zstd_level);

/// The same vertices, reordered for the vertex cache, through meshoptimizer's vertex and index codecs and zstd.
std::unique_ptr<PackingCodec> meshopt_codec(int zstd_level);

/// Draco's edgebreaker, compression level 10, explicit quantisation at the step; normals of 12, uvs of 14 bits.
std::unique_ptr<PackingCodec> draco_codec();

/// What this project's file is to hold.
struct PacktraceFile {
  PageCodec codec = PageCodec::kNone;
  bool keep_uvs = false; ///< as for a mask of 1024 x 1024 texels over [0,1]^2, else none, as for any scene without masks
  bool trees = false;    ///< for tracing; no other codec here has any
};
std::unique_ptr<PackingCodec> packtrace_codec(const PacktraceFile& wanted);

/// Angle between two directions, degrees.
double angle_degrees(Vec3 a, Vec3 b);

} // namespace packtrace
