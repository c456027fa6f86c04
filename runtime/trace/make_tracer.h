#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "runtime/gpu/gpu_config.h"
#include "runtime/trace/embree/embree_tracer.h"

namespace packtrace {

class BakedFile;
class LodSource;
class StructureCache;

enum class Backend : uint8_t {
  kEmbree, ///< Embree over triangles decoded to floats
  kPacked, ///< traces the packed clusters of a baked file directly
  kGpu,    ///< does the same on a GPU with Vulkan, or lets its driver trace (GpuConfig::structures)
};

struct TracerConfig {
  Backend backend = Backend::kEmbree;
  EmbreeConfig embree;
  Movers movers = {}; ///< instances that RayTracer::place_instances() may move
  GpuConfig gpu = {}; ///< of backend gpu
  /// With GpuStructures::kDriver: the structures that all tracers of the scene share; null: each has its own.
  std::shared_ptr<StructureCache> structures = nullptr;
};

/// Chooses a backend by its name: embree, packed, gpu, or gpu-rt, which is gpu with GpuStructures::kDriver. Returns
/// false for other names.
bool set_backend(TracerConfig& config, std::string_view name);
/// The name for set_backend().
std::string_view backend_name(const TracerConfig& config);

/// The structures that tracers of a scene with this config share as TracerConfig::structures; null if none.
/// Throws as StructureCache's constructor does.
std::shared_ptr<StructureCache> make_structure_cache(const TracerConfig& config);

/// Creates a tracer; the only function that refers to all backends. Keeps references: source and file must outlive the
/// tracer.
/// @param file the file that `source` reads, or null if it reads floats
/// Throws Error(kUnsupported) for the backends packed and gpu without a file, and for gpu if it was not built; else as
/// the backend's constructor.
std::unique_ptr<RayTracer> make_tracer(const SceneSource& source, const BakedFile* file, const TracerConfig& config);

/// Creates a tracer of other instances of the file that another tracer reads at LOD level 0. Shares that tracer's trees
/// if the backend is packed. Throws as make_tracer().
/// @param whole of the same config; needed during this call only
std::unique_ptr<RayTracer> make_tracer_beside(const RayTracer& whole, const SceneSource& source, const BakedFile* file,
                                              const TracerConfig& config);

/// Creates a tracer at the detail of a plan. Throws as the backend's constructor.
std::unique_ptr<RayTracer> make_tracer(const LodSource& source, const BakedFile& file, const TracerConfig& config);

/// Sum of the tracer's resident() bytes.
uint64_t resident_bytes(const RayTracer& tracer);

} // namespace packtrace
