#pragma once

#include <cstdint>
#include <memory>

#include "runtime/trace/embree/embree_tracer.h"

namespace packtrace {

class BakedFile;
class LodSource;
enum class ClusterPrimitives : uint8_t; // embree_cluster_tracer.h

enum class Backend : uint8_t {
  kEmbree,         ///< Embree over triangles decoded to floats
  kPacked,         ///< traces the packed clusters of a baked file directly
  kEmbreeClusters, ///< the same with Embree's trees over the clusters
};

struct TracerConfig {
  Backend backend = Backend::kEmbree;
  EmbreeConfig embree;
  ClusterPrimitives cluster_primitives{}; ///< for kEmbreeClusters; kClusters
};

/// Creates a tracer; the only function that knows all backends. Keeps references: source and file must outlive the
/// tracer.
/// @param file the file that `source` reads, or null if it reads floats
/// Throws Error(kUnsupported) for backends packed and embree-clusters without a file, else as the backend's
/// constructor.
std::unique_ptr<RayTracer> make_tracer(const SceneSource& source, const BakedFile* file, const TracerConfig& config);

/// Creates a tracer at the detail of a plan. Throws Error(kUnsupported) for embree-clusters, else as the backend's
/// constructor.
std::unique_ptr<RayTracer> make_tracer(const LodSource& source, const BakedFile& file, const TracerConfig& config);

/// Sum of the tracer's resident() bytes.
uint64_t resident_bytes(const RayTracer& tracer);

} // namespace packtrace
