#pragma once

#include <cstdint>
#include <vector>

#include "pbrt_import/gltf/gltf_document.h"

namespace packtrace::gltf {

/// Values of an accessor with as many components per element.
struct AccessorValues {
  std::vector<float> values;
  uint64_t count = 0;      ///< elements
  uint32_t components = 0; ///< per element: 1 to 4 for SCALAR to VEC4, 4, 9 or 16 for matrices
};

/// Reads an accessor of any component type as floats: normalized integers are scaled to [0, 1] or [-1, 1], sparse
/// values replaced. They are counted as memory while a ValuesInUse lives. Throws Error(kInput) if it does not lie
/// within its buffer; MemoryError. Source: glTF 2.0 specification, section 3.6.2.
AccessorValues read_floats(Document& document, uint64_t accessor);

/// Reads an accessor of unsigned integers, of one component. Throws like read_floats().
std::vector<uint32_t> read_indices(Document& document, uint64_t accessor);

} // namespace packtrace::gltf
