#include "runtime/denoise/denoiser.h"

#include <cmath>
#include <cstdint>

#include <benchmark/benchmark.h>

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
      g.motion_px[i] = Vec2(motion, 0.0f);
      if (inside > 0.0f) {
        g.view_z[i] = 6.0f - std::sqrt(inside), g.normal[i] = Vec3(bx, -by, -std::sqrt(inside)), g.instance[i] = 2;
      } else if (v > 0.6f) {
        g.view_z[i] = 2.0f / (v - 0.4f), g.normal[i] = Vec3(0, 1, 0), g.instance[i] = 1;
      } else {
        g.view_z[i] = 10.0f, g.normal[i] = Vec3(0, 0, -1), g.instance[i] = 0;
      }
    }
  }
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

/// Wall time of one frame of width x height with a warm history; the camera stands still or moves by a fraction of a
/// pixel.
void BM_DenoiseFrame(benchmark::State& state) {
  const ImageSize size{static_cast<uint32_t>(state.range(0)), static_cast<uint32_t>(state.range(1))};
  const GBuffer gbuffer = make_room(size, state.range(2) != 0 ? 0.4f : 0.0f);
  const AoFrame frames[2] = {make_noise(size, 1), make_noise(size, 2)};
  AoDenoiser denoiser;
  for (int64_t i = 0; i < state.range(3); ++i) denoiser.next_frame(gbuffer, frames[i % 2]);
  size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(denoiser.next_frame(gbuffer, frames[i++ % 2]).ao.data());
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(size.pixels()));
}
BENCHMARK(BM_DenoiseFrame)
    ->ArgNames({"width", "height", "moving", "history"})
    ->Args({960, 540, 0, 16})
    ->Args({960, 540, 1, 16})
    ->Args({1920, 1080, 0, 16})
    ->Args({1920, 1080, 1, 16})
    ->Args({1920, 1080, 0, 256})
    ->Iterations(20)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

} // namespace
} // namespace packtrace

BENCHMARK_MAIN();
