#include "runtime/trace/make_tracer.h"

#include "pbrt_import/base/error.h"
#include "runtime/trace/embree/embree_cluster_tracer.h"
#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {

std::unique_ptr<RayTracer> make_tracer(const SceneSource& source, const BakedFile* file, const TracerConfig& config) {
  if (config.backend != Backend::kEmbree) {
    if (file == nullptr)
      throw Error(ErrorKind::kUnsupported,
                  "backends packed and embree-clusters trace baked files only; bake the scene, or use embree");
    if (config.backend == Backend::kPacked) return std::make_unique<PackedTracer>(*file, source);
    return std::make_unique<EmbreeClusterTracer>(*file, source, chosen_isa(), config.cluster_primitives,
                                                 config.embree.memory);
  }
  return std::make_unique<EmbreeTracer>(source, config.embree);
}

std::unique_ptr<RayTracer> make_tracer(const LodSource& source, const BakedFile& file, const TracerConfig& config) {
  if (config.backend == Backend::kEmbreeClusters)
    throw Error(ErrorKind::kUnsupported, "backend embree-clusters traces level 0 only; use packed or embree");
  if (config.backend == Backend::kPacked) return std::make_unique<PackedTracer>(file, source);
  return std::make_unique<EmbreeTracer>(source, config.embree);
}

uint64_t resident_bytes(const RayTracer& tracer) {
  uint64_t bytes = 0;
  for (const ResidentPart& part : tracer.resident()) bytes += part.bytes;
  return bytes;
}

} // namespace packtrace
