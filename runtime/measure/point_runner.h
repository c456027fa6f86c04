#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "runtime/measure/ao_error.h"
#include "runtime/measure/child_process.h"
#include "runtime/measure/matrix.h"
#include "runtime/measure/measure_folder.h"

namespace packtrace {

/// Settings that all points of a measurement share.
struct RunnerConfig {
  std::string scene;
  std::string identity; ///< text of the program's version and the state of the scene's files
  Words common;         ///< options of every command: --threads, --max-memory
  Words scene_options;  ///< --world and --time
  Words bake_options;   ///< further options of every bake
  ImageSize size;
  std::optional<std::string> camera;
  uint32_t spp = 64;
  uint64_t seed = 0, noise_seed = 1;
  uint64_t distance_samples = 200'000;
  bool embree_beside_each_point = true;
  double diagonal = 0.0;         ///< of the scene, world units
  std::string denoiser = "ours"; ///< --denoiser of points that are denoised
  Words tracer;                  ///< options of render for points that packed traces: --backend, --gpu-device
};

/// Options of render for the knobs, with the denoiser if they use one, and the tracer in place of packed.
Words render_words(const RenderKnobs& knobs, const RunnerConfig& config);

/// A failed stage of a point.
struct StageFailure {
  std::string stage;
  ChildResult child;
};

/// Value of "error" in a report.
nlohmann::json to_json(const StageFailure& failure);
/// "failed", "killed" or "out-of-memory".
std::string status_of(const StageFailure& failure);

/// Measures points in separate processes, and keeps the results in the folder. The file of the last bake is
/// kept for points that trace the same file.
class PointRunner {
public:
  /// Keeps a reference to the folder.
  PointRunner(RunnerConfig config, const MeasureFolder& folder);
  ~PointRunner();
  PointRunner(const PointRunner&) = delete;
  PointRunner& operator=(const PointRunner&) = delete;

  /// Renders the float images, or takes them from the folder. Must succeed before measure().
  /// @return "reference" of the report. Throws Error with the exit code's kind if a render fails.
  nlohmann::json make_reference();

  /// Whether an earlier run measured the point.
  bool is_measured(const MeasurePoint& point) const;

  /// A point of the report, without flags. Failures of its processes are part of it, except those to write: throws
  /// Error(kIo), since all other points would fail too.
  nlohmann::json measure(const MeasurePoint& point);

  /// "convergence" of the report for the given file options; an empty array if a process fails.
  nlohmann::json convergence(const BakeKnobs& bake, const std::vector<uint32_t>& frames);

  /// "resolution" of the report: occlusion at full and quarter resolution, for equal samples per pixel and for equal
  /// rays; an empty array if a process fails.
  nlohmann::json resolution(const BakeKnobs& bake, const std::vector<uint32_t>& samples);

  /// Commands that a user types for a point, by name: bake and render.
  nlohmann::json commands(const MeasurePoint& point) const;
  /// Name of the point's files in the folder.
  std::string key(const MeasurePoint& point) const;

  const AoImage& reference() const { return *reference_; }
  std::filesystem::path reference_file() const { return folder_ / "reference/float.exr"; }

private:
  nlohmann::json run(const std::string& stage, Words words);
  nlohmann::json render(const std::string& stage, const std::string& input, const std::filesystem::path& output,
                        uint64_t seed, const Words& options);
  void bake(const BakeKnobs& knobs);
  /// Loads an array from the folder. If it is not there, bakes a file, fills the array and saves it.
  /// @param entries number of settings to measure, part of the array's name
  /// @return the array; an empty one, not saved, if a process fails
  nlohmann::json load_or_fill(const std::string& kind, const BakeKnobs& knobs, size_t entries,
                              const std::function<void(nlohmann::json& array)>& fill);
  void add_file_values(nlohmann::json& point) const;
  void add_render_values(nlohmann::json& point, const MeasurePoint& what);
  void add_noise_ratio(nlohmann::json& ao) const;

  RunnerConfig config_;
  const MeasureFolder& folder_;
  std::optional<AoImage> reference_;
  double noise_mae_ = 0.0;
  std::optional<BakeKnobs> baked_;                                ///< options of the file in the folder
  nlohmann::json bake_report_, comparison_;                       ///< JSON of bake and compare for that file
  std::vector<std::pair<BakeKnobs, nlohmann::json>> comparisons_; ///< by the options that decide the surfaces
};

} // namespace packtrace
