#pragma once

#include <cstdint>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/gpu/records/gpu_records.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "runtime/trace/unit_space.h"

namespace packtrace {

/// Tables of a scene from which a GPU makes the surfaces of hits: see gpu::DeviceRays::set_surfaces().
struct SurfaceTables {
  std::vector<gpu::InstanceSurface> instances; ///< by instance; zeros for those that cannot be hit
  std::vector<uint32_t> lookup;
};

/// @param tracer the packed tracer beside the GPU's
SurfaceTables surface_tables(const BakedFile& file, const SceneSource& source, const PackedTracer& tracer);

/// @param previous not an environment camera
/// @param no_motion_px kNoMotionPx
gpu::SurfaceViewRecord surface_view_record(const PrimaryCamera& now, const PrimaryCamera& previous,
                                           const UnitSpace& space, double no_motion_px);

} // namespace packtrace
