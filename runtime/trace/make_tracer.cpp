#include "runtime/trace/make_tracer.h"

#include "pbrt_import/base/error.h"
#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {

std::unique_ptr<RayTracer> make_tracer(const SceneSource& source, const BakedFile* file, const TracerConfig& config) {
  if (config.backend == Backend::kEmbree) return std::make_unique<EmbreeTracer>(source, config.embree, config.movers);
  if (file == nullptr)
    throw Error(ErrorKind::kUnsupported, "backend packed traces baked files only; bake the scene, or use embree");
  return std::make_unique<PackedTracer>(*file, source, chosen_isa(), config.movers);
}

std::unique_ptr<RayTracer> make_tracer(const LodSource& source, const BakedFile& file, const TracerConfig& config) {
  if (config.backend == Backend::kEmbree) return std::make_unique<EmbreeTracer>(source, config.embree, config.movers);
  return std::make_unique<PackedTracer>(file, source, chosen_isa(), config.movers);
}

uint64_t resident_bytes(const RayTracer& tracer) {
  uint64_t bytes = 0;
  for (const ResidentPart& part : tracer.resident()) bytes += part.bytes;
  return bytes;
}

} // namespace packtrace
