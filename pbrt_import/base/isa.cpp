#include "pbrt_import/base/isa.h"

#include <cstdlib>
#include <string>
#include <string_view>

#include "pbrt_import/base/cpu.h"
#include "pbrt_import/base/error.h"

namespace packtrace {

bool isa_supported(Isa isa) {
  if (isa == Isa::kScalar) return true;
#if defined(__x86_64__)
  if (isa == Isa::kAvx2) return cpu_has_avx2();
  return cpu_has_avx2() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
         __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512vbmi") &&
         __builtin_cpu_supports("avx512vbmi2") && __builtin_cpu_supports("avx512vpopcntdq");
#else
  return false;
#endif
}

Isa chosen_isa() {
  if (const char* name = std::getenv("PACKTRACE_ISA"); name != nullptr && *name != '\0') {
    const std::string_view isa(name);
    if (isa == "scalar") return Isa::kScalar;
    if (isa == "avx2") return Isa::kAvx2;
    if (isa == "avx512") return Isa::kAvx512;
    throw Error(ErrorKind::kUsage, "PACKTRACE_ISA is \"" + std::string(isa) + "\", not scalar, avx2 or avx512");
  }
  for (const Isa isa : {Isa::kAvx512, Isa::kAvx2})
    if (isa_supported(isa)) return isa;
  return Isa::kScalar;
}

} // namespace packtrace
