#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "pbrt_import/base/progress.h"
#include "runtime/measure/point_runner.h"

namespace packtrace {

/// Input of a measurement.
struct MeasureConfig {
  MatrixMode mode = MatrixMode::kDefault;
  MatrixScene matrix_scene;
  RunnerConfig runner;
  std::string version, command;
  nlohmann::json scene;                    ///< "scene" of the report
  nlohmann::json machine;                  ///< "machine" of the report
  std::vector<std::string> instance_names; ///< names of the instances' geometries
  std::filesystem::path output;
  double max_error = 0.005; ///< mean absolute AO error that the user accepts
  bool force = false;
};

/// Measures all points of a scene and writes the report into its folder. Finished points of the folder are reused.
/// @return the report. Throws Error(kIo) for folders that cannot be used, Error(kCancelled), and an Error of the kind
/// of the failed command if the float reference cannot be rendered. Failures of points are in the report.
nlohmann::json run_measure(const MeasureConfig& config, Progress& progress);

} // namespace packtrace
