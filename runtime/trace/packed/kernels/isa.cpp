#include "runtime/trace/packed/kernels/isa.h"

#include <cstdlib>
#include <string>
#include <string_view>

#include "pbrt_import/base/error.h"

namespace packtrace {

bool isa_supported(PackedIsa isa) {
  if (isa == PackedIsa::kScalar) return true;
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
                    __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("lzcnt") &&
                    __builtin_cpu_supports("popcnt");
  if (isa == PackedIsa::kAvx2) return avx2;
  return avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
         __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512vbmi") &&
         __builtin_cpu_supports("avx512vbmi2") && __builtin_cpu_supports("avx512vpopcntdq");
#else
  return false;
#endif
}

const packed::Kernels& kernels_of(PackedIsa isa) {
  if (!isa_supported(isa)) throw Error(ErrorKind::kUnsupported, "this machine lacks the instruction set to trace with");
#if defined(__x86_64__)
  if (isa == PackedIsa::kAvx512) return packed::kAvx512Kernels;
  if (isa == PackedIsa::kAvx2) return packed::kAvx2Kernels;
#endif
  return packed::kScalarKernels;
}

PackedIsa chosen_isa() {
  if (const char* name = std::getenv("PACKTRACE_ISA"); name != nullptr && *name != '\0') {
    const std::string_view isa(name);
    if (isa == "scalar") return PackedIsa::kScalar;
    if (isa == "avx2") return PackedIsa::kAvx2;
    if (isa == "avx512") return PackedIsa::kAvx512;
    throw Error(ErrorKind::kUsage, "PACKTRACE_ISA is \"" + std::string(isa) + "\", not scalar, avx2 or avx512");
  }
  for (const PackedIsa isa : {PackedIsa::kAvx512, PackedIsa::kAvx2})
    if (isa_supported(isa)) return isa;
  return PackedIsa::kScalar;
}

} // namespace packtrace
