#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace packtrace {

using GltfJson = nlohmann::json;

/// Component types and targets of glTF 2.0.
inline constexpr int kGltfByte = 5120, kGltfShort = 5122, kGltfUnsignedShort = 5123, kGltfUnsignedInt = 5125,
                     kGltfFloat = 5126;
inline constexpr int kGltfVertices = 34962, kGltfIndices = 34963;
inline constexpr int kGltfTriangleStrip = 5; ///< mode of a primitive

/// Whether 16-bit indices suffice. 65535 restarts strips in some viewers.
constexpr bool fits_short_indices(size_t vertices) { return vertices <= 65535; }

/// The number with the fewest digits that reads as the same float.
double shortest(float value);
GltfJson shortest(std::span<const float> values);

/// How EXT_meshopt_compression codes a buffer view.
struct MeshoptCoding {
  std::string mode;   ///< ATTRIBUTES or TRIANGLES
  std::string filter; ///< empty: none
  uint32_t stride = 0;
  uint64_t count = 0;
};

/// Builds a glTF 2.0 document: its JSON and one binary buffer.
class GltfModel {
public:
  GltfModel();

  /// Appends an element to a top-level array, such as "nodes"; returns its number.
  int add(const char* array, GltfJson element);
  size_t count(const char* array) const;
  GltfJson& element(const char* array, int index) { return json_[array][static_cast<size_t>(index)]; }
  const GltfJson& json() const { return json_; }
  GltfJson& scene_nodes() { return json_["scenes"][0]["nodes"]; }
  void set_asset_extras(GltfJson extras) { json_["asset"]["extras"] = std::move(extras); }

  /// Appends bytes to the buffer, aligned to 4 bytes, as a new buffer view; returns its number.
  /// Throws Error(kLimitExceeded) beyond the size limit of a .glb.
  /// @param target kGltfVertices, kGltfIndices or 0
  int add_view(std::span<const std::byte> bytes, int target);
  /// Appends a buffer view compressed by EXT_meshopt_compression.
  int add_compressed_view(std::span<const std::byte> compressed, int target, const MeshoptCoding& coding);
  /// Number of a buffer view that is filled later.
  int reserve_view() { return add("bufferViews", GltfJson::object()); }
  void fill_compressed_view(int view, std::span<const std::byte> compressed, int target, const MeshoptCoding& coding);

  void use_extension(const std::string& name, bool required);

  /// The whole document as binary glTF.
  std::vector<std::byte> write_binary();
  /// The JSON text of a document whose buffer is stored apart.
  /// @param buffer_name file name of the buffer
  std::vector<std::byte> write_text(const std::string& buffer_name);
  /// The bytes of the buffer.
  std::vector<std::byte> take_buffer() { return std::move(buffer_); }

private:
  uint64_t append(std::span<const std::byte> bytes);
  void finish();

  GltfJson json_;
  std::vector<std::byte> buffer_;
  uint64_t uncompressed_bytes_ = 0; ///< of the views that are compressed
};

} // namespace packtrace
