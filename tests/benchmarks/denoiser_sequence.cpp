#include "tests/benchmarks/denoiser_sequence.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "compress/format/deformation/deformation_view.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/world_view.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/ao/moved_occluders.h"
#include "runtime/camera/deformed_past.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/frame/camera_path.h"
#include "runtime/frame/frame_loop.h"
#include "runtime/frame/mean_layers.h"
#include "runtime/frame/scene_state.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "tests/benchmarks/denoiser_occluder.h"

namespace packtrace {
namespace {

/// Frames that share a shift of the camera rays, as in FrameLoop.
constexpr uint32_t kFramesPerShift = 2;
constexpr uint32_t kTruthShifts = 64;
constexpr double kAnimatedFps = 24.0;

class SequenceTracer {
public:
  /// @param movers of tracer and scene
  SequenceTracer(const TraceInput& input, const SequenceOptions& options, const Movers& movers = {})
      : input_(input), options_(options), tracer_(input.file, input.source, chosen_isa(), movers),
        camera_(first_camera(input.source, options.size, options.framed)) {
    ao_.radius = ao_radius({}, input.source.world_bounds());
  }

  DenoiserSequence still() {
    DenoiserSequence sequence;
    GBuffer g;
    camera_rays(view(camera_), view(camera_), g);
    for (uint32_t f = 0; f < options_.frames; ++f) {
      sequence.gbuffers.push_back(f == 0 ? guides_of(g) : GBuffer{});
      sequence.ao.push_back(occlusion(g, f));
    }
    sequence.truth[options_.frames] = truth(g);
    return sequence;
  }

  DenoiserSequence jittered() {
    DenoiserSequence sequence;
    sequence.source = HistorySource::kPixel;
    GBuffer g, mean;
    MeanLayers layers;
    for (uint32_t f = 0; f < options_.frames; ++f) {
      if (f % kFramesPerShift == 0) {
        shifted_rays(f / kFramesPerShift, g);
        layers.add(g, input_.source.materials());
        layers.keep(g);
        layers.write_guides(g, mean);
      }
      sequence.gbuffers.push_back(f == 0 ? guides_of(g) : f % kFramesPerShift == 0 ? guides_of(mean) : GBuffer{});
      sequence.ao.push_back(occlusion(g, f));
    }
    sequence.truth[options_.frames] = jittered_truth();
    return sequence;
  }

  DenoiserSequence orbit() {
    DenoiserSequence sequence;
    GBuffer g;
    camera_rays(view(camera_), view(camera_), g);
    std::vector<float> depths;
    std::ranges::copy_if(g.view_z, std::back_inserter(depths), [](float z) { return z > 0.0f; });
    if (depths.empty()) throw Error(ErrorKind::kUsage, "the camera sees nothing");
    std::ranges::nth_element(depths, depths.begin() + static_cast<ptrdiff_t>(depths.size() / 2));
    const DVec3 forward = glm::normalize(DVec3(camera_.world_from_camera[2]));
    const DVec3 pivot = DVec3(camera_.world_from_camera[3]) + forward * double{depths[depths.size() / 2]};
    const auto at = [&](uint32_t frame) {
      return view(
          orbited(camera_, pivot, estimate_world_view(input_.source.cameras()).up, options_.degrees_per_frame * frame));
    };
    for (uint32_t f = 0; f < options_.frames; ++f) {
      camera_rays(at(f), at(f > 0 ? f - 1 : 0), g);
      sequence.gbuffers.push_back(guides_of(g));
      sequence.ao.push_back(occlusion(g, f));
      if (std::ranges::count(kComparedFrames, f + 1) > 0) sequence.truth[f + 1] = truth(g);
    }
    return sequence;
  }

  /// The box moves, and is gone after half of the frames.
  DenoiserSequence occluder(const Occluder& box) {
    DenoiserSequence sequence;
    GBuffer g;
    const PrimaryCamera camera = view(camera_);
    std::vector<Affine> before;
    for (const PlacedGeometry& placed : input_.source.instances()) before.push_back(placed.world_from_object);
    const uint32_t gone = options_.frames / 2;
    const Bounds object = object_bounds(input_.file.geometries()[input_.source.instances()[box.instance].geometry]);
    for (uint32_t f = 0; f < options_.frames; ++f) {
      std::optional<MovedBox> moved;
      if (f > gone) {
        sequence.gbuffers.emplace_back();
      } else {
        const Affine now = f < gone ? box.at(f, gone) : box.gone;
        if (f == 0) before[box.instance] = now;
        tracer_.place_instances(std::span(&box.instance, 1), std::span(&now, 1));
        trace_primary(input_.source, tracer_, camera, {camera, before}, g, progress_);
        if (f > 0) moved = moved_box(box.instance, object, DAffine(before[box.instance]), object, DAffine(now));
        before[box.instance] = now;
        sequence.gbuffers.push_back(guides_of(g));
      }
      sequence.ao.push_back(occlusion(g, f));
      if (moved) sequence.ao.back().max_history = history_limits(std::span(&*moved, 1), g, ao_, ao_.radius);
      if (f < gone ? std::ranges::count(kComparedFrames, f + 1) > 0 : f == gone)
        sequence.truth[f < gone ? f + 1 : options_.frames] = truth(g);
    }
    return sequence;
  }

  /// As FrameLoop traces what moves.
  DenoiserSequence animated() {
    const SceneMotion motion = SceneMotion::of(input_.file);
    const bool deforms = !deformation_records(input_.file.sections().deformation).empty();
    if (!motion.moves() && !deforms) throw Error(ErrorKind::kUsage, "--motion animated: nothing moves in the scene");
    TracerConfig packed;
    packed.backend = Backend::kPacked;
    SceneState state({&input_.source, &input_.file, packed, &motion, deforms}, {});
    DenoiserSequence sequence;
    const PrimaryCamera camera = view(camera_);
    GBuffer g;
    for (uint32_t f = 0; f < options_.frames; ++f) {
      FrameReport report;
      state.advance(DVec3(camera_.world_from_camera[3]), f / kAnimatedFps, report);
      state.build_level_0(report);
      const RayTracer& tracer = *state.tracers().front();
      std::optional<DeformedPast> surfaces;
      if (f > 0 && state.deforming_tracer() != nullptr) surfaces.emplace(*state.deforming_tracer());
      const PreviousFrame before{camera, f > 0 ? state.previous_transforms() : std::span<const Affine>(),
                                 surfaces ? &*surfaces : nullptr};
      trace_primary(state.camera_source(), tracer, camera, before, g, progress_);
      sequence.gbuffers.push_back(guides_of(g));
      sequence.ao.push_back(occlusion(tracer, g, f));
      sequence.ao.back().max_history = history_limits(state.moved_boxes(), g, ao_, ao_.radius);
      if (std::ranges::count(kComparedFrames, f + 1) > 0)
        sequence.truth[f + 1] = occlusion(tracer, g, 0, options_.truth_spp, 1).ao;
    }
    return sequence;
  }

private:
  PrimaryCamera view(const Camera& camera) const { return {camera, options_.size}; }

  void camera_rays(const PrimaryCamera& now, const PrimaryCamera& before, GBuffer& g) {
    trace_primary(input_.source, tracer_, now, before, g, progress_);
  }

  void shifted_rays(uint32_t shift, GBuffer& g) {
    const PrimaryCamera camera(camera_, options_.size, jitter_offset(shift));
    camera_rays(camera, camera, g);
  }

  /// The arrays that the denoiser reads.
  static GBuffer guides_of(const GBuffer& g) {
    GBuffer guides;
    guides.size = g.size;
    guides.view_z = g.view_z, guides.normal = g.normal, guides.instance = g.instance;
    guides.motion_px = g.motion_px, guides.previous_z = g.previous_z, guides.pixel_spread = g.pixel_spread;
    return guides;
  }

  AoFrame occlusion(const GBuffer& g, uint32_t frame, uint32_t spp = 1, uint64_t seed = 0) {
    return occlusion(tracer_, g, frame, spp, seed);
  }
  AoFrame occlusion(const RayTracer& tracer, const GBuffer& g, uint32_t frame, uint32_t spp = 1, uint64_t seed = 0) {
    AoConfig config = ao_;
    config.spp = spp, config.seed = seed;
    AoFrame frame_ao;
    trace_ao(input_.source, tracer, g, config, frame, frame_ao, progress_);
    return frame_ao;
  }

  std::vector<float> truth(const GBuffer& g) { return occlusion(g, 0, options_.truth_spp, 1).ao; }

  std::vector<float> jittered_truth() {
    const size_t n = options_.size.pixels();
    std::vector<double> sum(n), count(n);
    GBuffer g;
    for (uint32_t shift = 0; shift < kTruthShifts; ++shift) {
      shifted_rays(shift, g);
      const AoFrame frame = occlusion(g, shift, std::max(1u, options_.truth_spp / kTruthShifts), 1);
      for (size_t i = 0; i < n; ++i)
        if (frame.ao[i] >= 0.0f) sum[i] += double{frame.ao[i]}, count[i] += 1.0;
    }
    std::vector<float> mean(n, kInvalidAo);
    for (size_t i = 0; i < n; ++i)
      if (count[i] > 0.0) mean[i] = static_cast<float>(sum[i] / count[i]);
    return mean;
  }

  const TraceInput& input_;
  const SequenceOptions options_;
  PackedTracer tracer_;
  const Camera camera_;
  AoConfig ao_;
  Progress progress_;
};

DenoiserSequence trace_sequence(const std::string& scene, const TraceInputOptions& inputs, SequenceKind kind,
                                const SequenceOptions& options) {
  if (kind == SequenceKind::kOccluder) {
    const SceneWithOccluder input(scene, inputs, options.size, options.framed);
    return SequenceTracer(*input.traced, options, input.movers).occluder(input.box);
  }
  const auto input = load_trace_input(scene, inputs);
  SequenceTracer tracer(*input, options);
  return kind == SequenceKind::kStill      ? tracer.still()
         : kind == SequenceKind::kJittered ? tracer.jittered()
         : kind == SequenceKind::kAnimated ? tracer.animated()
                                           : tracer.orbit();
}

/// Reads or writes all values of a sequence, in one order.
class SequenceFile {
public:
  SequenceFile(const std::filesystem::path& file, bool write)
      : stream_(file, std::ios::binary | (write ? std::ios::out | std::ios::trunc : std::ios::in)), write_(write) {}

  /// Returns whether everything could be read or written.
  bool all(DenoiserSequence& s) {
    uint64_t frames = s.ao.size(), truths = s.truth.size();
    value(s.source), value(frames), value(truths);
    s.gbuffers.resize(frames), s.ao.resize(frames);
    for (GBuffer& g : s.gbuffers)
      value(g.size), value(g.pixel_spread), values(g.view_z), values(g.normal), values(g.instance), values(g.motion_px),
          values(g.previous_z);
    for (AoFrame& a : s.ao)
      value(a.size), value(a.ray_length), values(a.ao), values(a.hit_distance), values(a.max_history);
    auto next = s.truth.begin();
    for (uint64_t i = 0; i < truths; ++i) {
      uint32_t frame = write_ ? next->first : 0;
      value(frame);
      values(write_ ? (next++)->second : s.truth[frame]);
    }
    stream_.flush();
    return stream_.good();
  }

private:
  template <typename T>
  void value(T& v) {
    if (write_)
      stream_.write(reinterpret_cast<const char*>(&v), sizeof(T));
    else
      stream_.read(reinterpret_cast<char*>(&v), sizeof(T));
  }
  template <typename T>
  void values(std::vector<T>& v) {
    uint64_t size = v.size();
    value(size);
    v.resize(size);
    const auto bytes = static_cast<std::streamsize>(size * sizeof(T));
    if (write_)
      stream_.write(reinterpret_cast<const char*>(v.data()), bytes);
    else
      stream_.read(reinterpret_cast<char*>(v.data()), bytes);
  }

  std::fstream stream_;
  const bool write_;
};

} // namespace

DenoiserSequence make_sequence(const std::string& scene, const TraceInputOptions& inputs, SequenceKind kind,
                               const SequenceOptions& options) {
  std::string motion = kSequenceKindNames[static_cast<size_t>(kind)];
  if (kind == SequenceKind::kOrbit) motion += fmt::format(" {:g}", options.degrees_per_frame);
  DenoiserSequence sequence;
  const std::string stem = std::filesystem::path(scene).stem().string();
  const auto file =
      options.cache / fmt::format("{}_{}{}_{}x{}_{}_{}.sequence3", stem, motion, options.framed ? "_framed" : "",
                                  options.size.width, options.size.height, options.frames, options.truth_spp);
  if (!options.cache.empty() && std::filesystem::exists(file)) {
    if (!SequenceFile(file, false).all(sequence)) throw Error(ErrorKind::kInput, file.string() + ": is incomplete");
  } else {
    sequence = trace_sequence(scene, inputs, kind, options);
    if (!options.cache.empty()) {
      const std::filesystem::path unfinished = file.string() + ".tmp";
      if (!SequenceFile(unfinished, true).all(sequence))
        throw Error(ErrorKind::kIo, file.string() + ": cannot be written");
      std::filesystem::rename(unfinished, file);
    }
  }
  for (AoFrame& ao : sequence.ao) ao.stratified = is_stratified(AoConfig{}.sampler);
  sequence.scene = stem, sequence.motion = motion, sequence.kind = kind;
  return sequence;
}

void play(const DenoiserSequence& sequence,
          const std::function<void(const GBuffer&, const AoFrame&, uint32_t frame)>& use) {
  GBuffer still;
  const GBuffer* current = nullptr;
  for (uint32_t f = 0; f < sequence.ao.size(); ++f) {
    const GBuffer& own = sequence.gbuffers[f];
    if (own.size.pixels() > 0) {
      current = &own;
    } else if (current != &still) {
      still = *current;
      std::ranges::fill(still.motion_px, Vec2(0)), still.previous_z.clear();
      current = &still;
    }
    use(*current, sequence.ao[f], f);
  }
}

} // namespace packtrace
