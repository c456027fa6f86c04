#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "pbrt_import/gltf/gltf_json.h"

namespace packtrace::gltf {

/// Layout of a buffer view that EXT_meshopt_compression compresses.
struct MeshoptView {
  uint64_t count = 0;
  uint32_t stride = 0; ///< bytes of an element
  enum class Mode : uint8_t { kAttributes, kTriangles, kIndices } mode = Mode::kAttributes;
  enum class Filter : uint8_t { kNone, kOctahedral, kQuaternion, kExponential } filter = Filter::kNone;

  uint64_t bytes() const { return count * stride; }
};

/// Reads and checks the extension's object. Throws Error(kInput).
MeshoptView read_meshopt_view(const Value& extension);
/// Decodes a view. Throws Error(kInput) if the data are damaged; indices may be out of range.
std::vector<std::byte> decode_meshopt(const MeshoptView& view, std::span<const std::byte> compressed,
                                      const Value& extension);

/// A primitive that KHR_draco_mesh_compression compresses, decoded.
struct DracoPrimitive {
  std::vector<uint32_t> indices; ///< three per triangle, all in range
  uint32_t vertices = 0;
  std::map<std::string, std::vector<float>> attributes; ///< values by name, such as POSITION
};

/// Attributes to decode, with their number of components.
using DracoWants = std::map<std::string, uint32_t>;

/// Decodes a primitive. Attributes that the data lack are left out. Throws Error(kInput) if the data are damaged.
/// @param extension the extension's object, which maps names to Draco's attribute numbers
DracoPrimitive decode_draco(std::span<const std::byte> compressed, const DracoWants& wants, const Value& extension);

} // namespace packtrace::gltf
