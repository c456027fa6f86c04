#include "tests/benchmarks/denoiser_cost.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>
#include <optional>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

GBuffer make_room(ImageSize size, float motion) {
  GBuffer g;
  g.resize(size);
  const float w = static_cast<float>(size.width), h = static_cast<float>(size.height);
  for (uint32_t y = 0; y < size.height; ++y) {
    for (uint32_t x = 0; x < size.width; ++x) {
      const size_t i = static_cast<size_t>(y) * size.width + x;
      const float v = (static_cast<float>(y) + 0.5f) / h, u = (static_cast<float>(x) + 0.5f) / w;
      const float bx = (u - 0.5f) * 4.0f, by = (v - 0.5f) * 4.0f * h / w, inside = 1.0f - bx * bx - by * by;
      if (inside > 0.0f) {
        g.view_z[i] = 6.0f - std::sqrt(inside), g.normal[i] = Vec3(bx, -by, -std::sqrt(inside)), g.instance[i] = 2;
      } else if (v > 0.6f) {
        g.view_z[i] = 2.0f / (v - 0.4f), g.normal[i] = Vec3(0, 1, 0), g.instance[i] = 1;
      } else {
        g.view_z[i] = 10.0f, g.normal[i] = Vec3(0, 0, -1), g.instance[i] = 0;
      }
      const float moved = motion * 30.0f / g.view_z[i];
      g.motion_px[i] = Vec2(moved, 0.3f * moved);
    }
  }
  if (motion != 0.0f) g.previous_z = g.view_z;
  return g;
}

/// Binary noise with p = 1/2.
AoFrame make_noise(ImageSize size, uint32_t seed) {
  AoFrame frame;
  frame.resize(size);
  uint32_t state = seed * 747796405u + 1u;
  for (float& ao : frame.ao) {
    state = state * 1664525u + 1013904223u;
    ao = (state >> 31) != 0 ? 1.0f : 0.25f;
  }
  return frame;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double process_cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

/// Reads and writes bytes once, with all threads.
class MemoryFloor {
public:
  MemoryFloor(size_t read_bytes, size_t written_bytes)
      : read_(read_bytes / sizeof(uint64_t), 1), written_(written_bytes / sizeof(uint64_t), 1) {}

  void run() {
    constexpr size_t kParts = 64;
    tbb::parallel_for(size_t{0}, kParts, [&](size_t part) {
      const auto at = [&](size_t size, size_t p) { return size * p / kParts; };
      uint64_t sum = 0;
      for (size_t i = at(read_.size(), part); i < at(read_.size(), part + 1); ++i) sum ^= read_[i];
      const size_t begin = at(written_.size(), part), end = at(written_.size(), part + 1);
      // The bytes depend on the sum, so that no read can be left out.
      std::memset(&written_[begin], static_cast<int>(sum & 255), (end - begin) * sizeof(uint64_t));
    });
  }

private:
  std::vector<uint64_t> read_, written_;
};

/// Wall time and CPU time of all threads in milliseconds, one entry per call.
class Times {
public:
  template <typename Work>
  void time(const Work& work) {
    const Stopwatch watch;
    const double before = process_cpu_ms();
    work();
    cpu_.push_back(process_cpu_ms() - before), wall_.push_back(watch.seconds() * 1e3);
  }
  double last_wall() const { return wall_.back(); }
  double wall() const { return median(wall_); }
  double cpu() const { return median(cpu_); }

private:
  std::vector<double> wall_, cpu_;
};

constexpr float kMotionPx = 0.4f; ///< a frame, at a distance of 30

MemoryFloor floor_of(const AoDenoiser& warm, ImageSize size, bool moving, DenoiserKind kind) {
  constexpr size_t kGuides = 20, kSamples = 8, kMotion = 8, kPreviousZ = 4, kResult = 12; // bytes a pixel
  const size_t saved = warm.save().size() / size.pixels();
  const size_t kept = !moving && kind == DenoiserKind::kOurs ? 14 : 0; // guides that a still view leaves as they are
  return {size.pixels() * (kGuides + kSamples + (moving ? kMotion + kPreviousZ : 0) + saved),
          size.pixels() * (kResult + saved - kept)};
}

} // namespace

struct DenoiserCostMeter::State {
  State(const DenoiserConfig& config, ImageSize size, bool moves, uint32_t warm_frames)
      : gbuffer(make_room(size, moves ? kMotionPx : 0.0f)), frames{make_noise(size, 1), make_noise(size, 2)},
        denoiser(config), moving(moves) {
    for (uint32_t i = 0; i < warm_frames; ++i) denoiser.add_frame(gbuffer, frames[i % 2]);
    denoiser.denoise();
    floor.emplace(floor_of(denoiser, size, moves, config.kind));
  }
  GBuffer gbuffer;
  AoFrame frames[2];
  AoDenoiser denoiser;
  bool moving;
  std::optional<MemoryFloor> floor;
  Times history, filter, memory;
  size_t next = 0;
};

DenoiserCostMeter::DenoiserCostMeter(const DenoiserConfig& config, ImageSize size, bool moving, uint32_t warm_frames)
    : state_(std::make_unique<State>(config, size, moving, warm_frames)) {}

DenoiserCostMeter::~DenoiserCostMeter() = default;

double DenoiserCostMeter::time_frame() {
  State& s = *state_;
  s.memory.time([&] { s.floor->run(); });
  const HistorySource source = s.moving ? HistorySource::kMotion : HistorySource::kUnchanged; // as FrameLoop
  s.history.time([&] { s.denoiser.add_frame(s.gbuffer, s.frames[s.next++ % 2], source); });
  s.filter.time([&] { s.denoiser.denoise(); });
  return (s.history.last_wall() + s.filter.last_wall()) * 1e-3;
}

DenoiserCost DenoiserCostMeter::cost() const {
  const State& s = *state_;
  DenoiserCost cost;
  cost.history_ms = s.history.wall(), cost.history_cpu = s.history.cpu();
  cost.filter_ms = s.filter.wall(), cost.filter_cpu = s.filter.cpu();
  cost.floor_ms = s.memory.wall(), cost.floor_cpu = s.memory.cpu();
  cost.bytes_per_pixel = static_cast<double>(s.denoiser.state_bytes()) / static_cast<double>(s.gbuffer.size.pixels());
  return cost;
}

std::string cost_table(const std::vector<std::pair<std::string, DenoiserConfig>>& presets,
                       const std::vector<ImageSize>& sizes) {
  constexpr uint32_t kWarmFrames = 16, kTimedFrames = 20;
  std::string table = "| CPU ms a frame of all threads together | denoiser | history | filter | sum | floor | "
                      "sum / floor | bytes a pixel |\n|---|---|---|---|---|---|---|---|\n";
  for (const ImageSize size : sizes)
    for (const bool moving : {false, true})
      for (const auto& [name, config] : presets) {
        DenoiserCostMeter meter(config, size, moving, kWarmFrames);
        for (uint32_t i = 0; i < kTimedFrames; ++i) meter.time_frame();
        const DenoiserCost cost = meter.cost();
        table +=
            fmt::format("| {} x {}, {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.0f} |\n", size.width,
                        size.height, moving ? "moving" : "still", name, cost.history_cpu, cost.filter_cpu,
                        cost.history_cpu + cost.filter_cpu, cost.floor_cpu, cost.ratio_cpu(), cost.bytes_per_pixel);
      }
  return table;
}

} // namespace packtrace
