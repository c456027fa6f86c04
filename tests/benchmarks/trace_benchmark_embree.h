#pragma once

#include <memory>

#include "runtime/trace/embree/embree_tracer.h"

namespace packtrace {

/// The Embree functions that trace the rays.
enum class EmbreeCall {
  kSingle,   ///< rtcIntersect1, rtcOccluded1
  kPacket16, ///< rtcIntersect16, rtcOccluded16
  kStream,   ///< rtcIntersect1M, rtcOccluded1M
};

/// Traces the trees of an EmbreeTracer with one kind of call, for any ray order. Embree's coherent or incoherent flag
/// follows the order.
/// @param tracer must outlive the result
std::unique_ptr<RayTracer> direct_embree(const EmbreeTracer& tracer, EmbreeCall call);

} // namespace packtrace
