#include <benchmark/benchmark.h>

#include "tests/benchmarks/denoiser_cost.h"

namespace packtrace {
namespace {

/// A frame of width x height with a warm history; the camera stands still or moves sideways. *_ms are wall times, *_cpu
/// CPU times of all threads together. `history` is add_frame(), `filter` is denoise(); the filter with fewer passes
/// shows what each pass takes.
void BM_DenoiseFrame(benchmark::State& state) {
  const ImageSize size{static_cast<uint32_t>(state.range(0)), static_cast<uint32_t>(state.range(1))};
  DenoiserConfig config;
  config.ours.passes = static_cast<uint32_t>(state.range(4));
  DenoiserCostMeter meter(config, size, state.range(2) != 0, static_cast<uint32_t>(state.range(3)));
  for (auto _ : state) state.SetIterationTime(meter.time_frame());
  const DenoiserCost cost = meter.cost();
  state.counters["history_ms"] = cost.history_ms;
  state.counters["history_cpu"] = cost.history_cpu;
  state.counters["filter_ms"] = cost.filter_ms;
  state.counters["filter_cpu"] = cost.filter_cpu;
  state.counters["floor_ms"] = cost.floor_ms;
  state.counters["floor_cpu"] = cost.floor_cpu;
  state.counters["ratio"] = (cost.history_ms + cost.filter_ms) / cost.floor_ms;
  state.counters["ratio_cpu"] = cost.ratio_cpu();
  state.counters["bytes_px"] = cost.bytes_per_pixel;
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
