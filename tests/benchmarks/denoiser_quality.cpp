// Quality of denoisers: PSNR, SSIM and FLIP against the ground truth after 1 to 64 frames of still and moving views,
// what remains of an occluder that is gone, and flicker.

#include <algorithm>
#include <cstdio>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/denoiser_cost.h"
#include "tests/benchmarks/denoiser_scores.h"
#include "tests/benchmarks/denoiser_sequence.h"

namespace packtrace {
namespace {

using nlohmann::json;

json to_json(const SequenceScore& s) {
  json images = json::array(), ghosts = json::array();
  for (const auto& [frames, i] : s.images)
    images.push_back({{"frames", frames}, {"psnr", i.psnr}, {"ssim", i.ssim}, {"flip", i.flip}, {"bias", i.bias}});
  for (const auto& [frames, left] : s.ghosts) ghosts.push_back({{"frames", frames}, {"left", left}});
  return {{"scene", s.scene},
          {"motion", s.motion},
          {"denoiser", s.denoiser},
          {"images", images},
          {"ghosts", ghosts},
          {"flicker", s.flicker},
          {"truth_flicker", s.truth_flicker},
          {"add_frame_ms", s.add_frame_ms},
          {"denoise_ms", s.denoise_ms}};
}

/// @param first the first denoiser's score of the same sequence
void print(const SequenceScore& s, const SequenceScore& first) {
  for (const auto& [frames, i] : s.images)
    fmt::print("{:10} {:10} {:9} {:3}  {:6.2f} {:.4f} {:.4f} {:+.5f} {}\n", s.scene, s.motion, s.denoiser, frames,
               i.psnr, i.ssim, i.flip, i.bias, i.flip > first.images.at(frames).flip ? "FLIP is worse" : "");
  for (const auto& [frames, left] : s.ghosts)
    fmt::print("{:10} {:10} {:9} {:3} frames after the occluder is gone: {:.2f} % of it left\n", s.scene, s.motion,
               s.denoiser, frames, 100.0 * left);
  if (s.truth_flicker > 0.0)
    fmt::print("{:10} {:10} the truth of the first two frames flickers by {:.5f}\n", s.scene, s.motion,
               s.truth_flicker);
  fmt::print("{:10} {:10} {:9} flicker {:.5f}; ms: add_frame {:.2f}, denoise {:.2f}\n", s.scene, s.motion, s.denoiser,
             s.flicker, s.add_frame_ms, s.denoise_ms);
}

/// Sizes as WIDTHxHEIGHT.
std::vector<ImageSize> sizes_of(const std::vector<std::string>& texts) {
  std::vector<ImageSize> sizes;
  for (const std::string& text : texts) {
    ImageSize size;
    char end = 0;
    if (std::sscanf(text.c_str(), "%ux%u%c", &size.width, &size.height, &end) != 2 || size.pixels() == 0)
      throw Error(ErrorKind::kUsage, "--cost " + text + ": must be WIDTHxHEIGHT");
    sizes.push_back(size);
  }
  return sizes;
}

/// The costs of those denoisers that are one.
std::string costs(const std::vector<std::string>& denoisers, const DenoiserConfig& config,
                  const std::vector<ImageSize>& sizes) {
  std::vector<std::pair<std::string, DenoiserConfig>> presets;
  for (const std::string& name : denoisers)
    if (const auto preset = preset_of(name, config)) presets.emplace_back(name, *preset);
  return sizes.empty() ? "" : cost_table(presets, sizes);
}

SequenceKind kind_of(const std::string& name) {
  const auto* const found = std::ranges::find(kSequenceKindNames, name);
  if (found == std::end(kSequenceKindNames))
    throw Error(ErrorKind::kUsage, "--motion " + name + ": must be still, jittered, orbit, occluder or animated");
  return static_cast<SequenceKind>(found - std::begin(kSequenceKindNames));
}

int run(int argc, char** argv) {
  std::vector<std::string> scenes{"house"}, motions{"still", "jittered", "orbit"}, framed, settings;
  std::vector<std::string> denoisers{"off", "history", "ours"}, cost_sizes;
  std::filesystem::path json_file, csv_file, markdown_file;
  TraceInputOptions inputs;
  SequenceOptions options;
  BenchmarkOptions command_line("Quality of denoisers against the ground truth");
  command_line.add("scenes", scenes, "house, spaceship, killeroo, bunny, town, meadow, or .ptk and .pbrt files")
      .show_default();
  command_line.add("--scenes", inputs.scenes, "Folder of house, spaceship, killeroo and bunny")
      .environment("PACKTRACE_SCENES");
  command_line.add("--motion", motions, "still, jittered, orbit, occluder and animated").show_default();
  command_line.add("--framed", framed, "Scenes of which the whole is shown instead of the view of their first camera");
  command_line.add("--frames", options.frames, "Frames of a sequence").show_default();
  command_line.add("--width", options.size.width).show_default();
  command_line.add("--height", options.size.height).show_default();
  command_line.add("--truth-spp", options.truth_spp, "Samples per pixel of the ground truth").show_default();
  command_line.add("--degrees", options.degrees_per_frame, "Degrees per frame of the orbit").show_default();
  command_line.add("--cache", options.cache, "Folder to keep traced sequences in");
  command_line.add("--denoiser", denoisers, "ours, history (ours without filter), reference, off (mean of the samples)")
      .show_default();
  command_line.add("--denoiser-set", settings, "Change settings of ours, or of reference without ours and history")
      .type_name("NAME=VALUE");
  command_line.add("--cost", cost_sizes, "Also time the denoisers on a synthetic room of these sizes")
      .type_name("WIDTHxHEIGHT");
  command_line.add("--json", json_file, "Also write the figures to this file");
  command_line.add("--csv", csv_file, "Also write the figures to this file, one a line");
  command_line.add("--markdown", markdown_file, "Also write a table to this file");
  if (const auto exit_code = command_line.parse(argc, argv)) return *exit_code;
  DenoiserConfig config;
  if (std::ranges::none_of(denoisers, [](const std::string& d) { return d == "ours" || d == "history"; }))
    config.kind = DenoiserKind::kReference;
  for (const std::string& setting : settings) config.set(setting);
  config.validate();
  const std::vector<ImageSize> sizes = sizes_of(cost_sizes);
  FiguresFile figures(json_file);
  TextFile csv(csv_file), markdown(markdown_file);
  std::vector<SequenceScore> scores;
  json all = json::array();
  fmt::print("{:10} {:10} {:9} {:>3}  PSNR, SSIM, FLIP, bias\n", "scene", "motion", "denoiser", "n");
  for (const std::string& scene : scenes) {
    options.framed = std::ranges::count(framed, scene) > 0;
    for (const std::string& motion : motions) {
      const DenoiserSequence sequence = make_sequence(scene, inputs, kind_of(motion), options);
      const size_t first = scores.size();
      for (const std::string& denoiser : denoisers) {
        scores.push_back(score(sequence, denoiser, config));
        print(scores.back(), scores[first]);
        all.push_back(to_json(scores.back()));
      }
    }
  }
  figures.write(all);
  const std::string cost = costs(denoisers, config, sizes);
  fmt::print("{}", cost);
  csv.write(csv_of(scores)), markdown.write(markdown_of(scores) + (cost.empty() ? "" : "\n" + cost));
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("denoiser_quality", packtrace::run, argc, argv); }
