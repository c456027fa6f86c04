// Compares the ways to spend occlusion rays: rates, resolutions, samplers and sorting, by CPU time and by error.

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "pbrt_import/scene/world_view.h"
#include "runtime/frame/camera_path.h"
#include "runtime/frame/still.h"
#include "runtime/trace/source/packed_source.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/thread_cpu_time.h"

namespace packtrace {
namespace {

struct Options {
  std::vector<std::string> files, modes;
  uint32_t width = 640, height = 360, repeats = 9, truth_spp = 1024;
  double degrees = 0.5;
};

struct Mode {
  std::string name;
  std::function<void(FrameConfig&)> change;
};

const std::vector<Mode> kModes{
    {"full", [](FrameConfig&) {}},
    {"sorted", [](FrameConfig& c) { c.ao.sort_rays = true; }},
    {"checkerboard", [](FrameConfig& c) { c.ao_rate = AoRate::kCheckerboard; }},
    {"quarter", [](FrameConfig& c) { c.ao_resolution = AoResolution::kQuarter; }},
    {"adaptive", [](FrameConfig& c) { c.ao_rate = AoRate::kAdaptive; }},
    {"any-hit", [](FrameConfig& c) { c.ao.falloff = false; }},
    {"any-hit sorted", [](FrameConfig& c) { c.ao.falloff = false, c.ao.sort_rays = true; }},
    {"sobol", [](FrameConfig& c) { c.ao.sampler = SamplerKind::kPixelSobol; }},
    {"jitter", [](FrameConfig& c) { c.ao.sampler = SamplerKind::kMultiJitter; }},
    {"lattice", [](FrameConfig& c) { c.ao.sampler = SamplerKind::kLattice; }},
    {"independent", [](FrameConfig& c) { c.ao.sampler = SamplerKind::kIndependent; }},
};

/// A scene, its camera, and the AO that pictures are compared with.
class Bench {
public:
  Bench(const std::string& name, const Options& options)
      : options_(options), file_(BakedFile::open(name)), source_(file_) {
    const ImageSize size{options.width, options.height};
    camera_ = source_.cameras().empty() ? framing_camera(source_.world_bounds(), size, source_.cameras())
                                        : source_.cameras().front();
    FrameLoop probe(scene(), config(kModes.front()));
    Progress unseen;
    if (!probe.next_frame(camera_, 0.0, unseen).seen)
      camera_ = framing_camera(source_.world_bounds(), size, source_.cameras());
    probe.next_frame(camera_, 0.0, unseen);
    std::vector<float> depths;
    for (const float z : probe.gbuffer().view_z)
      if (z > 0.0f) depths.push_back(z);
    const auto middle = depths.begin() + static_cast<ptrdiff_t>(depths.size() / 2);
    std::nth_element(depths.begin(), middle, depths.end());
    pivot_ = camera_.world_from_camera[3] + camera_.world_from_camera[2] * double{*middle};
  }

  FrameScene scene() const { return {&source_, &file_, {}}; }
  FrameConfig config(const Mode& mode) const {
    FrameConfig config;
    config.size = {options_.width, options_.height};
    config.jitter = false;
    mode.change(config);
    return config;
  }
  Camera camera(uint32_t frame, double degrees) const {
    return orbited(camera_, pivot_, estimate_world_view(source_.cameras()).up, degrees * frame);
  }

  std::vector<float> truth(const Camera& at, bool falloff) const {
    FrameConfig reference = config(kModes.front());
    reference.denoise = false, reference.ao.spp = 64, reference.ao.seed = 1, reference.ao.falloff = falloff;
    FrameLoop loop(scene(), reference);
    RenderedImage image;
    Progress unseen;
    render_still(loop, at, 0.0, std::max(1u, options_.truth_spp / 64), false, image, unseen);
    return image.ao;
  }

private:
  const Options& options_;
  BakedFile file_;
  PackedSource source_;
  Camera camera_;
  DVec3 pivot_{0.0};
};

double psnr_of(const std::vector<float>& ao, const std::vector<float>& truth, const std::vector<uint8_t>& mask = {}) {
  double sum = 0.0, count = 0.0;
  for (size_t i = 0; i < ao.size(); ++i)
    if (truth[i] >= 0.0f && (mask.empty() || mask[i] != 0)) {
      const double difference = double{std::max(ao[i], 0.0f)} - double{truth[i]};
      sum += difference * difference, count += 1.0;
    }
  return -10.0 * std::log10(sum / count);
}

/// PSNR of a still after 1, 8 and 32 frames.
std::string still_errors(const Bench& bench, const Mode& mode, const std::vector<float>& truth) {
  FrameLoop loop(bench.scene(), bench.config(mode));
  std::string text;
  Progress unseen;
  for (uint32_t frame = 1; frame <= 32; ++frame) {
    loop.next_frame(bench.camera(0, 0.0), 0.0, unseen);
    if (frame != 1 && frame != 8 && frame != 32) continue;
    RenderedImage image;
    PictureReport report;
    loop.resolve(image, report);
    text += fmt::format(" {:6.2f}", psnr_of(image.ao, truth));
  }
  return text;
}

/// PSNR of the 32nd frame of an orbit, and that of its pixels that have been in view for at most 4 frames.
std::string moving_errors(const Bench& bench, const Mode& mode, double degrees, const std::vector<float>& truth) {
  FrameLoop loop(bench.scene(), bench.config(mode));
  AdaptiveRate ages; // follows the surfaces
  Progress unseen;
  RenderedImage image;
  double rays = 0.0, hits = 0.0;
  for (uint32_t frame = 0; frame < 32; ++frame) {
    const PictureReport report = render_picture(loop, bench.camera(frame, degrees), 0.0, 1, image, unseen);
    ages.next_frame(loop.gbuffer(), false, 1);
    rays += static_cast<double>(report.ao_rays);
    for (const float z : loop.gbuffer().view_z) hits += z > 0.0f ? 1.0 : 0.0;
  }
  std::vector<uint8_t> young;
  for (const uint8_t age : ages.ages()) young.push_back(age <= 4 ? 1 : 0);
  return fmt::format(" {:6.2f} {:6.2f} {:6.3f}", psnr_of(image.ao, truth), psnr_of(image.ao, truth, young),
                     rays / hits);
}

/// Medians of the CPU time of a frame's occlusion rays in milliseconds, of all modes in turn.
std::vector<double> times(const Bench& bench, const std::vector<Mode>& modes, uint32_t repeats) {
  std::vector<std::unique_ptr<FrameLoop>> loops;
  std::vector<std::function<void()>> frames;
  Progress unseen;
  for (const Mode& mode : modes) {
    FrameConfig config = bench.config(mode);
    config.denoise = false; // so that a still frame is little but occlusion rays
    FrameLoop& loop = *loops.emplace_back(std::make_unique<FrameLoop>(bench.scene(), config));
    frames.emplace_back([&bench, &loop, &unseen] { loop.next_frame(bench.camera(0, 0.0), 0.0, unseen); });
  }
  return median_cpu_ms(frames, repeats);
}

void compare(const std::string& file, const Options& options) {
  const Bench bench(file, options);
  std::vector<Mode> modes;
  for (const Mode& mode : kModes)
    if (options.modes.empty() || std::ranges::find(options.modes, mode.name) != options.modes.end())
      modes.push_back(mode);
  const std::vector<double> ms = times(bench, modes, options.repeats);
  fmt::print("{}: {} x {} pixels\n{:<15} {:>8} {:>6}   {:>20}   {:>20}\n", file, options.width, options.height, "",
             "CPU ms", "", "still, 1 8 32 frames", "orbit: all, young, rays per pixel");
  if (options.truth_spp == 0) {
    for (size_t i = 0; i < modes.size(); ++i)
      fmt::print("{:<15} {:8.2f} {:6.3f}\n", modes[i].name, ms[i], ms[i] / ms[0]);
    return;
  }
  std::vector<float> still[2], moved[2];
  for (size_t i = 0; i < modes.size(); ++i) {
    const size_t falloff = bench.config(modes[i]).ao.falloff ? 1 : 0;
    if (still[falloff].empty()) {
      still[falloff] = bench.truth(bench.camera(0, 0.0), falloff == 1);
      moved[falloff] = bench.truth(bench.camera(31, options.degrees), falloff == 1);
    }
    fmt::print("{:<15} {:8.2f} {:6.3f}  {}  {}\n", modes[i].name, ms[i], ms[i] / ms[0],
               still_errors(bench, modes[i], still[falloff]),
               moving_errors(bench, modes[i], options.degrees, moved[falloff]));
    std::fflush(stdout);
  }
}

int run(int argc, char** argv) {
  Options options;
  BenchmarkOptions command_line(
      "Compares rates, resolutions, samplers and sorting of occlusion rays by CPU time of one thread and by the "
      "error of the denoised picture");
  command_line.add("FILE", options.files, ".ptk files").required();
  command_line.add("--mode", options.modes, "Modes to compare (default: all)").delimiter(',');
  command_line.add("--width", options.width).show_default();
  command_line.add("--height", options.height).show_default();
  command_line.add("--repeats", options.repeats, "Frames to time").show_default();
  command_line.add("--truth-spp", options.truth_spp, "Samples of the reference; 0: times only").show_default();
  command_line.add("--degrees", options.degrees, "Degrees per frame of the orbit").show_default();
  if (const std::optional<int> code = command_line.parse(argc, argv)) return *code;
  for (const std::string& file : options.files) compare(file, options);
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("ao_benchmark", packtrace::run, argc, argv); }
