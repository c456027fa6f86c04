#include "runtime/trace/make_tracer.h"

#include "pbrt_import/scene/error.h"

namespace packtrace {
namespace {

/// Of a baked file, or of floats if file is null.
std::unique_ptr<RayTracer> make_packed_tracer(const SceneSource& source, const BakedFile* file) {
  static_cast<void>(source), static_cast<void>(file); // PackedTracer goes here
  throw Error(ErrorKind::kUnsupported, "backend packed is not in this build; use embree");
}

} // namespace

std::unique_ptr<RayTracer> make_tracer(const SceneSource& source, const BakedFile* file, const TracerConfig& config) {
  if (config.backend == Backend::kPacked) return make_packed_tracer(source, file);
  return std::make_unique<EmbreeTracer>(source, config.embree);
}

uint64_t resident_bytes(const RayTracer& tracer) {
  uint64_t bytes = 0;
  for (const ResidentPart& part : tracer.resident()) bytes += part.bytes;
  return bytes;
}

} // namespace packtrace
