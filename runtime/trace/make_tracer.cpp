#include "runtime/trace/make_tracer.h"

#include <string>

#include "pbrt_import/base/error.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#if defined(PACKTRACE_HAS_GPU)
#include "runtime/trace/gpu/gpu_tracer.h"
#endif

namespace packtrace {
namespace {

/// @tparam Source SceneSource or LodSource
template <typename Source>
std::unique_ptr<RayTracer> make_gpu_tracer([[maybe_unused]] const Source& source,
                                           [[maybe_unused]] const BakedFile& file,
                                           [[maybe_unused]] const TracerConfig& config) {
#if defined(PACKTRACE_HAS_GPU)
  return std::make_unique<GpuTracer>(file, source, config.gpu, config.movers, config.structures);
#else
  throw Error(ErrorKind::kUnsupported, "packtrace was built without backend gpu; use --backend packed");
#endif
}

} // namespace

std::string_view backend_name(const TracerConfig& config) {
  if (config.backend == Backend::kEmbree) return "embree";
  if (config.backend == Backend::kPacked) return "packed";
  return config.gpu.structures == GpuStructures::kDriver ? "gpu-rt" : "gpu";
}

bool set_backend(TracerConfig& config, std::string_view name) {
  if (name == "embree")
    config.backend = Backend::kEmbree;
  else if (name == "packed")
    config.backend = Backend::kPacked;
  else if (name == "gpu" || name == "gpu-rt")
    config.backend = Backend::kGpu;
  else
    return false;
  config.gpu.structures = name == "gpu-rt" ? GpuStructures::kDriver : GpuStructures::kPacked;
  return true;
}

std::shared_ptr<StructureCache> make_structure_cache([[maybe_unused]] const TracerConfig& config) {
#if defined(PACKTRACE_HAS_GPU)
  if (config.backend == Backend::kGpu && config.gpu.structures == GpuStructures::kDriver)
    return std::make_shared<StructureCache>(config.gpu);
#endif
  return nullptr;
}

std::unique_ptr<RayTracer> make_tracer(const SceneSource& source, const BakedFile* file, const TracerConfig& config) {
  if (config.backend == Backend::kEmbree) return std::make_unique<EmbreeTracer>(source, config.embree, config.movers);
  if (file == nullptr)
    throw Error(ErrorKind::kUnsupported, "backend " + std::string(backend_name(config)) +
                                             " traces baked files only; bake the scene, or use embree");
  if (config.backend == Backend::kGpu) return make_gpu_tracer(source, *file, config);
  return std::make_unique<PackedTracer>(*file, source, chosen_isa(), config.movers);
}

std::unique_ptr<RayTracer> make_tracer_beside(const RayTracer& whole, const SceneSource& source, const BakedFile* file,
                                              const TracerConfig& config) {
  const auto* const packed = dynamic_cast<const PackedTracer*>(&whole);
  if (config.backend == Backend::kPacked && packed != nullptr) return std::make_unique<PackedTracer>(*packed, source);
  return make_tracer(source, file, config);
}

std::unique_ptr<RayTracer> make_tracer(const LodSource& source, const BakedFile& file, const TracerConfig& config) {
  if (config.backend == Backend::kEmbree) return std::make_unique<EmbreeTracer>(source, config.embree, config.movers);
  if (config.backend == Backend::kGpu) return make_gpu_tracer(source, file, config);
  return std::make_unique<PackedTracer>(file, source, chosen_isa(), config.movers);
}

uint64_t resident_bytes(const RayTracer& tracer) {
  uint64_t bytes = 0;
  for (const ResidentPart& part : tracer.resident()) bytes += part.bytes;
  return bytes;
}

} // namespace packtrace
