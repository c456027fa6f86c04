#pragma once

#include <cstddef>
#include <cstdint>

namespace packtrace {

/// Readable bytes that a kernel needs behind the limit of its text, and before the text.
inline constexpr size_t kKernelReach = 72;
inline constexpr size_t kKernelLead = 17;

/// Result of a kernel.
struct NumberBatch {
  const char* end = nullptr; ///< one past the last number converted; the start of the text if there is none
  size_t count = 0;
  uint32_t line_ends = 0;              ///< line ends between the start of the text and `end`
  const char* last_line_end = nullptr; ///< last character of the last of these line ends; null: none
};

/// Converts numbers in plain notation, with at most 16 digits and an optional point, separated by white space. Stops at
/// a `]` or at the first word that is not such a number. Values are correctly rounded; minus zero is not an integer.
/// Numbers whose rounding the fast path cannot decide also stop the kernel.
/// @param text needs kKernelLead readable bytes before it, and kKernelReach behind limit
/// @param limit numbers that start at or behind it are not converted
/// @param values has room for `capacity` numbers
using IntegerKernel = NumberBatch (*)(const char* text, const char* limit, int32_t* values, size_t capacity);
using FloatKernel = NumberBatch (*)(const char* text, const char* limit, float* values, size_t capacity);
using DoubleKernel = NumberBatch (*)(const char* text, const char* limit, double* values, size_t capacity);

struct NumberKernels {
  IntegerKernel integers = nullptr;
  FloatKernel floats = nullptr;
  DoubleKernel doubles = nullptr;
};

/// The kernels for this processor; null if there are none, and the portable scanners must be used.
const NumberKernels* number_kernels();

namespace avx2 {
NumberBatch convert_integers(const char* text, const char* limit, int32_t* values, size_t capacity);
NumberBatch convert_floats(const char* text, const char* limit, float* values, size_t capacity);
NumberBatch convert_doubles(const char* text, const char* limit, double* values, size_t capacity);
} // namespace avx2

} // namespace packtrace
