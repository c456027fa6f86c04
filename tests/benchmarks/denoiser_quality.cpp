// Quality of the denoiser: PSNR, SSIM and FLIP against the ground truth after 1 to 64 frames, beside the plain mean of
// the samples (still views) or the history without filter (moving ones).

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/image/metrics.h"
#include "runtime/stopwatch.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/denoiser_sequence.h"

namespace packtrace {
namespace {

using nlohmann::json;

struct Quality {
  double psnr = 0, ssim = 0, flip = 0, bias = 0;
};

/// Compares the pixels that have a truth. An image without value there is open.
Quality compare(ImageSize size, const std::vector<float>& ao, const std::vector<float>& truth) {
  Image test(size, 1), reference(size, 1);
  std::vector<uint8_t> valid(size.pixels());
  Quality quality;
  double count = 0;
  for (size_t i = 0; i < size.pixels(); ++i) {
    valid[i] = truth[i] >= 0.0f ? 1 : 0;
    if (valid[i] == 0) continue;
    test.data[i] = ao[i] >= 0.0f ? ao[i] : 1.0f, reference.data[i] = truth[i];
    quality.bias += double{test.data[i]} - double{truth[i]}, count += 1.0;
  }
  const MetricOptions options{valid};
  quality.psnr = psnr(test, reference, options).value, quality.ssim = ssim(test, reference, options).value;
  quality.flip = flip(test, reference, options).value, quality.bias /= std::max(count, 1.0);
  return quality;
}

/// The plain mean of each pixel's samples.
class PlainMean {
public:
  void add(const AoFrame& frame) {
    sum_.resize(frame.ao.size()), count_.resize(frame.ao.size());
    for (size_t i = 0; i < frame.ao.size(); ++i)
      if (frame.ao[i] >= 0.0f) sum_[i] += double{frame.ao[i]}, count_[i] += 1.0;
  }
  std::vector<float> result() const {
    std::vector<float> mean(sum_.size(), kInvalidAo);
    for (size_t i = 0; i < mean.size(); ++i)
      if (count_[i] > 0.0) mean[i] = static_cast<float>(sum_[i] / count_[i]);
    return mean;
  }

private:
  std::vector<double> sum_, count_;
};

/// The settings without filter.
DenoiserConfig unfiltered(DenoiserConfig config) {
  config.kind = DenoiserKind::kOurs, config.ours.passes = 0;
  return config;
}

json to_json(const Quality& q) { return {{"psnr", q.psnr}, {"ssim", q.ssim}, {"flip", q.flip}, {"bias", q.bias}}; }

json measure(const DenoiserSequence& sequence, const DenoiserConfig& config) {
  AoDenoiser denoiser(config), history(unfiltered(config));
  PlainMean mean;
  double add_s = 0, denoise_s = 0;
  json rows = json::array();
  play(sequence, [&](const GBuffer& g, const AoFrame& ao, uint32_t frame) {
    const Stopwatch adding;
    denoiser.add_frame(g, ao, sequence.source);
    add_s += adding.seconds();
    sequence.moves() ? history.add_frame(g, ao, sequence.source) : mean.add(ao);
    const uint32_t frames = frame + 1;
    if (std::ranges::count(kComparedFrames, frames) == 0) return;
    const Stopwatch denoising;
    const DenoisedAo& result = denoiser.denoise();
    denoise_s += denoising.seconds();
    const std::vector<float>& truth = sequence.truth_after(frames);
    const Quality before = compare(g.size, sequence.moves() ? history.denoise().ao : mean.result(), truth);
    const Quality after = compare(g.size, result.ao, truth);
    rows.push_back({{"frames", frames}, {"unfiltered", to_json(before)}, {"denoised", to_json(after)}});
    fmt::print("{:10} {:9} {:3}  {:6.2f} {:.4f} {:.4f}   {:6.2f} {:.4f} {:.4f}  {:+.5f}  {}\n", sequence.scene,
               sequence.motion, frames, before.psnr, before.ssim, before.flip, after.psnr, after.ssim, after.flip,
               after.bias - (sequence.moves() ? 0.0 : before.bias), after.flip < before.flip ? "" : "FLIP is worse");
  });
  const double frames = static_cast<double>(sequence.ao.size());
  fmt::print("{:10} {:9} ms: add_frame {:.2f}, denoise {:.2f}\n", sequence.scene, sequence.motion, 1e3 * add_s / frames,
             1e3 * denoise_s / static_cast<double>(rows.size()));
  return {{"scene", sequence.scene}, {"motion", sequence.motion}, {"rows", rows}};
}

int run(int argc, char** argv) {
  std::vector<std::string> scenes{"house"}, motions{"still", "jittered", "orbit"}, framed, settings;
  std::string denoiser = "ours";
  std::filesystem::path json_file;
  TraceInputOptions inputs;
  SequenceOptions options;
  CLI::App app("Quality of the denoiser against the ground truth");
  app.add_option("scenes", scenes, "house, spaceship, bunny, town, or .ptk and .pbrt files")->capture_default_str();
  app.add_option("--scenes", inputs.scenes, "Folder of house, spaceship and bunny")->envname("PACKTRACE_SCENES");
  app.add_option("--motion", motions, "still, jittered and orbit")->capture_default_str();
  app.add_option("--framed", framed, "Scenes of which the whole is shown instead of the view of their first camera");
  app.add_option("--frames", options.frames, "Frames of a sequence")->capture_default_str();
  app.add_option("--width", options.size.width)->capture_default_str();
  app.add_option("--height", options.size.height)->capture_default_str();
  app.add_option("--truth-spp", options.truth_spp, "Samples per pixel of the ground truth")->capture_default_str();
  app.add_option("--degrees", options.degrees_per_frame, "Degrees per frame of the orbit")->capture_default_str();
  app.add_option("--cache", options.cache, "Folder to keep traced sequences in");
  app.add_option("--denoiser", denoiser, "ours or reference")->check(CLI::IsMember({"ours", "reference"}));
  app.add_option("--denoiser-set", settings, "Change settings of the denoiser")->type_name("NAME=VALUE");
  app.add_option("--json", json_file, "Also write the figures to this file");
  if (const auto exit_code = parse_arguments(app, argc, argv)) return *exit_code;
  DenoiserConfig config;
  config.ours.stratified = true; // as the samples of make_sequence() are
  if (denoiser == "reference") config.kind = DenoiserKind::kReference;
  for (const std::string& setting : settings) config.set(setting);
  config.validate();
  FiguresFile figures(json_file);
  json all = json::array();
  fmt::print("{:10} {:9} {:>3}  unfiltered: PSNR, SSIM, FLIP   denoised: PSNR, SSIM, FLIP, change of the mean\n",
             "scene", "motion", "n");
  for (const std::string& scene : scenes) {
    std::unique_ptr<TraceInput> input;
    const auto load = [&]() -> const TraceInput& {
      if (!input) input = load_trace_input(scene, inputs);
      return *input;
    };
    options.framed = std::ranges::count(framed, scene) > 0;
    for (const std::string& motion : motions) {
      const SequenceKind kind =
          motion == "still"      ? SequenceKind::kStill
          : motion == "jittered" ? SequenceKind::kJittered
          : motion == "orbit"
              ? SequenceKind::kOrbit
              : throw Error(ErrorKind::kUsage, "--motion " + motion + ": must be still, jittered or orbit");
      all.push_back(measure(make_sequence(scene, load, kind, options), config));
    }
  }
  figures.write(all);
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("denoiser_quality", packtrace::run, argc, argv); }
