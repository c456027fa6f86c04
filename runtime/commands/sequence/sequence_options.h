#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "pbrt_import/base/memory_budget.h"
#include "runtime/frame/frame_loop.h"

namespace packtrace {

/// The options of `render` for sequences of pictures.
struct SequenceOptions {
  std::optional<std::string> path; ///< orbit[:DEGREES], turntable, scene or a file; unset: a still picture
  std::optional<double> fps;
  std::optional<uint32_t> subframes;
  std::optional<double> start_time;
  std::optional<std::string> keys; ///< file of motion keys
  bool resume = false;
  std::optional<double> checkpoint;  ///< seconds
  std::optional<std::string> stream; ///< format on standard output
  std::optional<std::string> csv;
};

/// Adds --path and the other options of sequences to a verb. `options` must outlive the verb.
void add_sequence_options(CLI::App& verb, SequenceOptions& options);

/// Throws Error(kUsage) for values out of range, and for options that require --path.
void validate(const SequenceOptions& options);

/// Time of the first picture in seconds, unless a file of camera keys sets it.
/// @param motion null if nothing moves
double start_time(const SequenceOptions& options, const SceneMotion* motion);

/// Whether the path starts with a camera of the scene that does not move. If it sees nothing, `render` replaces it.
/// @param index its number in the scene
bool begins_with_still_camera(const SequenceOptions& options, uint32_t index, const SceneMotion* motion);

/// The pictures of a sequence.
struct Sequence {
  uint64_t pictures = 0;
  double fps = 24.0;
  uint32_t subframes = 8;
  double start_s = 0.0;
  std::function<Camera(uint64_t picture)> camera;

  double time_s(uint64_t picture) const { return start_s + static_cast<double>(picture) / fps; }
};

/// Returns the sequence that the options describe.
/// @param pictures number of pictures; if not set, the length of the path's file or of the scene's motion, or 4 s
/// @param camera the camera at rest
/// @param index its number in the scene; none if it frames the whole scene
/// @param loop a frame loop of the scene; renders a frame to find what an orbit turns about, and is reset
/// Throws Error(kUsage) for options out of range, and like read_camera_path().
Sequence make_sequence(const SequenceOptions& options, std::optional<uint64_t> pictures, const SceneSource& source,
                       const Camera& camera, std::optional<uint32_t> index, FrameLoop& loop,
                       const MemoryBudget& memory);

} // namespace packtrace
