#include "runtime/gpu/shaders/spirv.h"

namespace packtrace::gpu::spirv {
namespace {

constexpr uint32_t kProbe[] = {
#include <probe.inc>
};
constexpr uint32_t kTraceAny[] = {
#include <trace_any.inc>
};
constexpr uint32_t kTraceClosest[] = {
#include <trace_closest.inc>
};

} // namespace

std::span<const uint32_t> probe() { return kProbe; }
std::span<const uint32_t> trace_any() { return kTraceAny; }
std::span<const uint32_t> trace_closest() { return kTraceClosest; }

} // namespace packtrace::gpu::spirv
