#pragma once

#include <cstddef>
#include <cstdint>

namespace packtrace {

/// How far number kernels read beyond the text they are given, and how far before it.
inline constexpr size_t kKernelReach = 72;
inline constexpr size_t kKernelLead = 17;

/// What a kernel did.
struct NumberBatch {
  const char* end = nullptr; ///< one past the last number converted; where the text started if there is none
  size_t count = 0;
  uint32_t line_ends = 0;              ///< from the start of the text to end
  const char* last_line_end = nullptr; ///< its last character; null: none
};

/// Convert numbers in plain notation, at most 16 digits with or without a point, that are set apart by space, up to a
/// `]` or the first word that is anything else. Values are rounded correctly; minus zero is no integer. A number that
/// takes more care than that is left alone.
/// @param text kKernelLead bytes before it and kKernelReach bytes behind limit must be readable
/// @param limit numbers that start at or behind it are left alone
/// @param values room for capacity numbers
using IntegerKernel = NumberBatch (*)(const char* text, const char* limit, int32_t* values, size_t capacity);
using FloatKernel = NumberBatch (*)(const char* text, const char* limit, float* values, size_t capacity);
using DoubleKernel = NumberBatch (*)(const char* text, const char* limit, double* values, size_t capacity);

struct NumberKernels {
  IntegerKernel integers = nullptr;
  FloatKernel floats = nullptr;
  DoubleKernel doubles = nullptr;
};

/// Those for this processor; null where there are none, and the portable scanners do it all.
const NumberKernels* number_kernels();

namespace avx2 {
NumberBatch convert_integers(const char* text, const char* limit, int32_t* values, size_t capacity);
NumberBatch convert_floats(const char* text, const char* limit, float* values, size_t capacity);
NumberBatch convert_doubles(const char* text, const char* limit, double* values, size_t capacity);
} // namespace avx2

} // namespace packtrace
