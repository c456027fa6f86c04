#include "runtime/denoise/denoiser.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <vector>

#include <benchmark/benchmark.h>
#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

/// A floor, a wall and a ball in front of them; the camera may move sideways.
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
      g.motion_px[i] = Vec2(motion * 30.0f / g.view_z[i], 0.0f);
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

/// Reads and writes the bytes of a frame's buffers once, with all threads.
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
      benchmark::DoNotOptimize(sum);
      const size_t begin = at(written_.size(), part), end = at(written_.size(), part + 1);
      std::memset(&written_[begin], static_cast<int>(sum & 255), (end - begin) * sizeof(uint64_t));
      benchmark::ClobberMemory();
    });
  }

private:
  std::vector<uint64_t> read_, written_;
};

/// Wall time and CPU time of all threads, one entry per call.
class Stopwatch {
public:
  template <typename Work>
  void time(const Work& work) {
    const auto begin = std::chrono::steady_clock::now();
    const double cpu = cpu_ms();
    work();
    cpu_.push_back(cpu_ms() - cpu);
    wall_.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  double wall() const { return median(wall_); }
  double cpu() const { return median(cpu_); }
  double last_wall() const { return wall_.back(); }

private:
  static double cpu_ms() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
  }
  static double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }
  std::vector<double> wall_, cpu_;
};

/// A frame of width x height with a warm history; the camera stands still or moves sideways. Each iteration times the
/// memory floor as well: reading the G-buffer, the samples and the state, and writing the result and what changes of
/// the state. Medians: *_ms are wall times, *_cpu CPU times of all threads together. `history` is add_frame(), `filter`
/// is denoise(); the filter with fewer passes shows what each pass takes.
void BM_DenoiseFrame(benchmark::State& state) {
  const ImageSize size{static_cast<uint32_t>(state.range(0)), static_cast<uint32_t>(state.range(1))};
  const bool moving = state.range(2) != 0;
  const GBuffer gbuffer = make_room(size, moving ? 0.4f : 0.0f);
  const AoFrame frames[2] = {make_noise(size, 1), make_noise(size, 2)};
  DenoiserConfig config;
  config.ours.passes = static_cast<uint32_t>(state.range(4));
  AoDenoiser denoiser(config);
  for (int64_t i = 0; i < state.range(3); ++i) denoiser.add_frame(gbuffer, frames[i % 2]);
  denoiser.denoise();
  const double pixels = static_cast<double>(size.pixels());
  const size_t saved = denoiser.save().size() / size.pixels();
  constexpr size_t kGuides = 20, kStoredGuides = 14, kResult = 12; // bytes a pixel
  MemoryFloor floor(size.pixels() * (kGuides + 8 + 4 + (moving ? 4 : 0) + saved),
                    size.pixels() * (kResult + (moving ? saved : saved - kStoredGuides)));
  Stopwatch history, filter, memory;
  size_t i = 0;
  for (auto _ : state) {
    memory.time([&] { floor.run(); });
    history.time([&] { denoiser.add_frame(gbuffer, frames[i++ % 2]); });
    filter.time([&] { benchmark::DoNotOptimize(denoiser.denoise().ao.data()); });
    state.SetIterationTime((history.last_wall() + filter.last_wall()) * 1e-3);
  }
  state.counters["history_ms"] = history.wall();
  state.counters["history_cpu"] = history.cpu();
  state.counters["filter_ms"] = filter.wall();
  state.counters["filter_cpu"] = filter.cpu();
  state.counters["floor_ms"] = memory.wall();
  state.counters["floor_cpu"] = memory.cpu();
  state.counters["ratio"] = (history.wall() + filter.wall()) / memory.wall();
  state.counters["ratio_cpu"] = (history.cpu() + filter.cpu()) / memory.cpu();
  state.counters["bytes_px"] = static_cast<double>(denoiser.state_bytes()) / pixels;
}
BENCHMARK(BM_DenoiseFrame)
    ->ArgNames({"width", "height", "moving", "frames", "passes"})
    ->Args({960, 540, 0, 16, 4})
    ->Args({960, 540, 1, 16, 4})
    ->Args({1920, 1080, 0, 16, 4})
    ->Args({1920, 1080, 0, 256, 4})
    ->Args({1920, 1080, 1, 16, 4})
    ->Args({1920, 1080, 1, 16, 3})
    ->Args({1920, 1080, 1, 16, 2})
    ->Args({1920, 1080, 1, 16, 1})
    ->Args({1920, 1080, 1, 16, 0})
    ->Iterations(20)
    ->Unit(benchmark::kMillisecond)
    ->UseManualTime();

} // namespace
} // namespace packtrace

BENCHMARK_MAIN();
