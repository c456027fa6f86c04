#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <vector>

#include "compress/exchange/gltf/gltf_model.h"

namespace packtrace {

/// Buffer views that EXT_meshopt_compression compresses. Values of one format share a view, because each view takes 250
/// bytes of JSON.
class MeshoptStreams {
public:
  explicit MeshoptStreams(GltfModel& model) : model_(model) {}

  struct Format {
    uint32_t stride = 0;     ///< bytes of an element: a multiple of 4, or 2 and 4 for a list of triangles
    int target = 0;          ///< kGltfVertices, kGltfIndices or 0
    std::string_view filter; ///< that decoders apply, a literal; empty: none
    bool list = false;       ///< triangles; otherwise elements of `stride` bytes
    bool operator<(const Format& other) const {
      return std::tie(stride, target, filter, list) < std::tie(other.stride, other.target, other.filter, other.list);
    }
  };

  /// Appends elements and adds an accessor for them; returns its number.
  /// @param bytes elements as the filter stores them
  /// @param accessor its type, componentType and so on, without place and count
  int add(const Format& format, std::span<const std::byte> bytes, GltfJson accessor);
  /// Appends triangles, with 16-bit indices if they fit.
  int add_indices(const std::vector<uint32_t>& indices, size_t vertices);

  /// Appends a triangle strip, coded as vertices whose components are its even and its odd indices.
  int add_strip(std::span<const std::array<uint32_t, 2>> strip, size_t vertices);

  /// Compresses all streams into their views; returns the compressed bytes.
  uint64_t finish();

private:
  struct Stream {
    int view = 0;
    std::vector<std::byte> bytes;
    std::vector<uint32_t> indices; ///< instead of bytes
  };
  Stream& stream(const Format& format);

  GltfModel& model_;
  std::map<Format, Stream> streams_;
};

/// Elements that the filter EXPONENTIAL stores: integers of up to 24 bits times a power of two.
/// @param components per element
std::vector<std::byte> exponential(std::span<const int64_t> mantissas, int exponent);

/// Largest magnitude of exponential()'s mantissas.
inline constexpr int64_t kMaxMantissa = (int64_t{1} << 23) - 1;

} // namespace packtrace
