#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/gltf/gltf_json.h"

namespace packtrace::gltf {

/// A primitive that KHR_draco_mesh_compression compresses, decoded.
struct DracoPrimitive {
  std::vector<uint32_t> indices; ///< three per triangle, all in range
  uint32_t vertices = 0;
  std::map<std::string, std::vector<float>> attributes; ///< values by name, such as POSITION
};

/// Attributes to decode, with their number of components.
using DracoWants = std::map<std::string, uint32_t>;

/// Decodes a primitive. Attributes that the data lack are left out. Throws Error(kInput) if the data are damaged;
/// MemoryError, before Draco allocates it, if they claim more than the budget has left. Tables of symbols are not
/// counted; Draco allocates at most 768 bytes per byte of data for them.
/// @param extension the extension's object, which maps names to Draco's attribute numbers
/// @param memory an empty reservation; it covers the result in the end
DracoPrimitive decode_draco(std::span<const std::byte> compressed, const DracoWants& wants, const Value& extension,
                            MemoryReservation& memory);

} // namespace packtrace::gltf
