#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "runtime/commands/denoise/denoise_inputs.h"
#include "runtime/commands/denoise/denoise_options.h"
#include "runtime/layered/layered_denoiser.h"

namespace packtrace {

/// Report of a denoised picture.
struct DenoisedRow {
  NumberedInput input;
  ImageSize size;
  PictureChannels channels;
  LayerCounts counts;
  HistoryStart start = HistoryStart::kContinued;
  std::optional<double> shared;
  double mean_history = 0.0, mean_ao = 0.0;
  double read_s = 0.0, denoise_s = 0.0, write_s = 0.0;

  DenoisedRow(const NumberedInput& picture, const LayeredResult& result);
};

/// The report of `denoise --json` (docs/json_output.md).
nlohmann::json denoise_json(const std::vector<DenoisedRow>& rows, const LayeredConfig& config,
                            const std::vector<std::string>& files);

/// Human-readable form of denoise_json().
/// @param details also the channels of the layers (-v)
std::string denoise_text(const nlohmann::json& report, bool details);

/// Warnings about a picture: values that are not finite, history that ended, missing motion. Empty
/// for most pictures.
/// @param still LayeredConfig::still
std::vector<std::string> picture_warnings(const DenoisedRow& row, bool sequence, bool still);

} // namespace packtrace
