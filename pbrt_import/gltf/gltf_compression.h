#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
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

} // namespace packtrace::gltf
