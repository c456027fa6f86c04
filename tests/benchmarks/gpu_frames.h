#pragma once

#include <cstdint>
#include <vector>

#include <nlohmann/json.hpp>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/gpu/gpu_config.h"
#include "runtime/trace/source/packed_source.h"

namespace packtrace {

/// 0 without values.
double median(std::vector<double> values);

/// Measures frames of a moving and of a still camera with backend gpu: the denoiser's dispatches against a copy kernel
/// that reads and writes as many bytes, whole frames on the wall clock, and the difference from backend packed.
/// @param within_limits set to whether each compared frame sees something, no pixel differs by more than 0.01 and no
/// frame by an RMS of more than 1e-4
nlohmann::json measure_gpu_frames(const BakedFile& file, const PackedSource& source, const Camera& camera,
                                  ImageSize size, const GpuConfig& device, uint32_t repeats, bool& within_limits);

/// Measures the time and the uploaded bytes of moving a hundredth of a scene's instances; null if no geometry is placed
/// twice.
nlohmann::json measure_gpu_placements(const BakedFile& file, const PackedSource& source, const GpuConfig& device,
                                      uint32_t repeats);

} // namespace packtrace
