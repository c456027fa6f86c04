#pragma once

#include <vector>

namespace packtrace::test {

/// The kernel sets that this processor supports.
/// @param fastest the set that the product uses; may be the portable one
template <typename Kernels>
std::vector<const Kernels*> kernel_sets(const Kernels& portable, const Kernels& fastest) {
  if (&fastest == &portable) return {&portable};
  return {&portable, &fastest};
}

} // namespace packtrace::test
