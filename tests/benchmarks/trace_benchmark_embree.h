#pragma once

#include <memory>

#include "runtime/trace/embree/embree_tracer.h"

namespace packtrace {

/// Which of Embree's calls get the rays.
enum class EmbreeCall {
  kSingle,   ///< rtcIntersect1, rtcOccluded1
  kPacket16, ///< rtcIntersect16, rtcOccluded16
  kStream,   ///< rtcIntersect1M, rtcOccluded1M
};

/// Traces the trees of an EmbreeTracer by one kind of call, whatever the order of rays; Embree's coherent or incoherent
/// flag is set as the order says.
/// @param tracer outlives the result
std::unique_ptr<RayTracer> direct_embree(const EmbreeTracer& tracer, EmbreeCall call);

} // namespace packtrace
