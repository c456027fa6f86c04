#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "runtime/camera/gbuffer.h"
#include "runtime/denoise/denoiser.h"
#include "tests/benchmarks/trace_benchmark_inputs.h"

namespace packtrace {

/// What moves in a DenoiserSequence.
enum class SequenceKind : uint8_t {
  kStill,    ///< nothing; all camera rays pass through pixel centres
  kJittered, ///< nothing; camera rays are shifted within their pixels, as FrameLoop does
  kOrbit,    ///< the camera
  /// A box that moves through the middle of a still view by about a pixel per frame, and after half of the frames
  /// is gone.
  kOccluder,
  kAnimated, ///< what moves in the scene itself, by 1/24 s a frame
};

/// The names of the kinds, as on the command line.
inline constexpr const char* kSequenceKindNames[] = {"still", "jittered", "orbit", "occluder", "animated"};

/// Frames of raw ambient occlusion with their G-buffers, and the ambient occlusion they are to approach.
struct DenoiserSequence {
  std::string scene, motion;
  SequenceKind kind = SequenceKind::kStill;
  HistorySource source = HistorySource::kMotion;
  /// Input of the denoiser: only the arrays that it reads. Frames without a separate G-buffer (of size 0) have
  /// that of the frame before, without motion.
  std::vector<GBuffer> gbuffers;
  std::vector<AoFrame> ao;
  std::map<uint32_t, std::vector<float>> truth; ///< by number of frames so far, ascending; kInvalidAo at misses

  bool moves() const { return kind != SequenceKind::kStill && kind != SequenceKind::kJittered; }
  /// Frames before the occluder is gone.
  uint32_t occluded_frames() const { return static_cast<uint32_t>(ao.size()) / 2; }
  /// The truth after that many frames: of still views, and once an occluder is gone, it is one picture.
  const std::vector<float>& truth_after(uint32_t frames) const { return truth.lower_bound(frames)->second; }
};

struct SequenceOptions {
  ImageSize size{640, 360};
  uint32_t frames = 64;
  uint32_t truth_spp = 1024;
  double degrees_per_frame = 0.5; ///< of orbits, about the point in the middle of the image
  bool framed = false;            ///< the camera frames the whole scene instead of the scene's first one
  std::filesystem::path cache;    ///< folder to keep sequences in; empty: none
};

/// Frame counts after which sequences have a truth and are compared with it.
inline constexpr uint32_t kComparedFrames[] = {1, 2, 4, 8, 16, 32, 64};

/// Traces a sequence with one sample per pixel and frame, or reads it from the cache.
/// @param inputs used only if the sequence is not in the cache
/// Throws Error(kUsage) for occluders in .ptk files and animations of scenes in which nothing moves, Error as
/// trace_primary() and trace_ao() do, and for files that cannot be read or written.
DenoiserSequence make_sequence(const std::string& scene, const TraceInputOptions& inputs, SequenceKind kind,
                               const SequenceOptions& options);

/// Calls use(gbuffer, ao, frame) for all frames; the G-buffer is the one to give to the denoiser.
void play(const DenoiserSequence& sequence,
          const std::function<void(const GBuffer&, const AoFrame&, uint32_t frame)>& use);

} // namespace packtrace
