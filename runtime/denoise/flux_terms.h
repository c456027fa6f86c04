#pragma once

#include <cstdint>

#include "runtime/denoise/flux_config.h"
#include "runtime/denoise/kernels/filter_rows.h"
#include "runtime/denoise/kernels/history_rows.h"

namespace packtrace {

// Parameters of the kernels, on the CPU and on GPUs, for a configuration.

/// LocateTerms::depth.
/// @param knows_previous_z whether GBuffer::previous_z is available
float located_depth(const FluxConfig& config, bool knows_previous_z);

/// LocateTerms::longest_moving.
float longest_moving(const FluxConfig& config);

CorrectTerms correct_terms(const FluxConfig& config);

PatchTerms patch_terms(const FluxConfig& config);

/// @param moving history was resampled
/// @param stratified AoFrame::stratified
/// @param samples AoFrame::samples
VarianceTerms variance_terms(const FluxConfig& config, bool moving, bool stratified, uint32_t samples);

} // namespace packtrace
