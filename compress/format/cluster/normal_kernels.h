#pragma once

#include <cstdint>

namespace packtrace {

/// Normals of an axis encoding in a cluster's payload; see docs/baked_format.md, "Normals".
struct AxisNormalStream {
  const uint8_t* bits = nullptr; ///< 8 bytes are readable behind the last normal
  uint32_t first_bit = 0, stride = 0, count = 0;
  uint32_t x_bits = 0, y_bits = 0;
  int32_t x_anchor = 0, y_anchor = 0;
  int32_t chart = 0; ///< added to the chart that follows x in the stream
  int32_t last = 0;  ///< highest code of x and y
  float scale = 0.0f, slope = 0.0f, cubic = 0.0f;
};

/// Decodes all normals to x, y, z triples.
using AxisNormalKernel = void (*)(const AxisNormalStream& stream, float* out);

/// Returns the kernel for this processor, which gives the same bits as decode_normal(fold_normal()); null if there is
/// none.
AxisNormalKernel axis_normal_kernel();

namespace avx2 {
void decode_axis_normals(const AxisNormalStream& stream, float* out);
}

} // namespace packtrace
