#include "runtime/commands/commands.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/output_file.h"
#include "pbrt_import/scene_format.h"
#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/cli/loaded_scene.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/compare/geometry_compare.h"
#include "runtime/image/false_color.h"
#include "runtime/image/metrics.h"
#include "runtime/image/png.h"
#include "runtime/image/read_image.h"

namespace packtrace {

namespace {

struct CompareOptions {
  std::string test, reference, layer;
  std::vector<std::string> metrics{"all"};
  std::array<std::optional<double>, 6> limits; ///< indexed like kMetrics
  std::optional<double> max_mismatch;          ///< fraction of pixels, [0, 1]
  double pixels_per_degree = kFlipPixelsPerDegree;
  uint64_t samples = kDefaultDistanceSamples; ///< points on each surface, for baked files
  std::string diff, diff_metric = "mae";
  float diff_white = 0.25f;
  SceneOptions scene;
};

struct MetricKind {
  const char* name;
  const char* json_name;
  bool higher_is_better;
  uint32_t smallest_side; ///< minimum image width and height, pixels
  bool colors_only;       ///< requires 1 or 3 channels
};
constexpr std::array<MetricKind, 6> kMetrics{{{"rmse", "rmse", false, 1, false},
                                              {"mae", "mae", false, 1, false},
                                              {"psnr", "psnr_db", true, 1, false},
                                              {"ssim", "ssim", true, kSsimWindow, false},
                                              {"flip", "flip", false, 1, true},
                                              {"p99", "p99", false, 1, false}}};

size_t metric_index(std::string_view name) {
  const auto found =
      std::find_if(kMetrics.begin(), kMetrics.end(), [&](const MetricKind& m) { return m.name == name; });
  return static_cast<size_t>(found - kMetrics.begin());
}

/// Two images with the same channels, and the pixels that have a value in both.
struct ImagePair {
  Image test, reference;
  std::string layer;
  std::vector<uint8_t> valid; ///< one entry per pixel, nonzero if compared; empty: all pixels
  uint64_t compared = 0;      ///< pixels with a value in both images
  uint64_t mismatched = 0;    ///< pixels with a value in only one image
  bool alpha_ignored = false;
  MemoryReservation memory; ///< of both images and of what metrics derive from them
};

void drop_alpha(LoadedImage& loaded) {
  if (loaded.alpha) loaded.image = keep_channels(loaded.image, loaded.image.channels - 1);
  loaded.alpha = false;
}

/// Mask of the pixels of an ambient occlusion layer that have a value. Empty for PNG files and other layers, where all
/// pixels have one.
std::vector<uint8_t> valid_pixels(const LoadedImage& loaded) {
  std::vector<uint8_t> valid;
  if (!loaded.layer.starts_with("ao") || loaded.image.channels != 1) return valid;
  valid.reserve(loaded.image.data.size());
  for (const float ao : loaded.image.data) valid.push_back(ao >= 0.0f || std::isnan(ao)); // NaN is an error to report
  return valid;
}

ImagePair load_pair(const CompareOptions& options, const MemoryBudget& budget) {
  LoadedImage test = read_image(options.test, options.layer, budget);
  LoadedImage reference = read_image(options.reference, options.layer, budget);
  if (test.image.size != reference.image.size)
    throw Error(ErrorKind::kInput,
                fmt::format("images differ in size: {} is {} x {} pixels, {} is {} x {}", options.test,
                            test.image.size.width, test.image.size.height, options.reference,
                            reference.image.size.width, reference.image.size.height));
  constexpr uint64_t kMetricBytesPerPixel = 64; // FLIP filters three channels of both images in floats
  ImagePair pair;
  pair.memory = std::move(test.memory);
  pair.memory.merge(std::move(reference.memory));
  pair.memory.resize(pair.memory.bytes() + test.image.size.pixels() * kMetricBytesPerPixel, "comparing the images");
  pair.layer = test.layer;
  pair.alpha_ignored = test.alpha || reference.alpha;
  drop_alpha(test), drop_alpha(reference);

  const std::vector<uint8_t> a = valid_pixels(test), b = valid_pixels(reference);
  pair.compared = test.image.size.pixels();
  if (!a.empty() || !b.empty()) {
    // If only one image can mark pixels without a value, its mask applies to both.
    pair.valid = a.empty() ? b : a;
    for (size_t i = 0; i < pair.valid.size() && !a.empty() && !b.empty(); ++i) {
      pair.mismatched += a[i] != b[i];
      pair.valid[i] = a[i] & b[i];
    }
    pair.compared = static_cast<uint64_t>(std::count(pair.valid.begin(), pair.valid.end(), 1));
  }
  if (test.image.channels == 1 && reference.image.channels == 3) test.image = grey_to_rgb(test.image);
  if (reference.image.channels == 1 && test.image.channels == 3) reference.image = grey_to_rgb(reference.image);
  pair.test = std::move(test.image), pair.reference = std::move(reference.image);
  return pair;
}

bool applicable(const MetricKind& kind, const Image& image) {
  if (std::min(image.size.width, image.size.height) < kind.smallest_side) return false;
  return !kind.colors_only || image.channels == 1 || image.channels == 3;
}

Metric compute(size_t metric, const ImagePair& pair, const CompareOptions& options, bool error_map) {
  const MetricOptions how{pair.valid, error_map};
  switch (metric) {
  case 0:
    return rmse(pair.test, pair.reference, how);
  case 1:
    return mae(pair.test, pair.reference, how);
  case 2:
    return psnr(pair.test, pair.reference, how);
  case 3:
    return ssim(pair.test, pair.reference, how);
  case 5:
    return p99(pair.test, pair.reference, how);
  default:
    return flip(pair.test, pair.reference, how, options.pixels_per_degree);
  }
}

/// Selects the metrics that are requested by name, by "all" (if applicable), by a limit, or for the difference picture.
std::array<bool, 6> wanted_metrics(const CompareOptions& options, const Image& image) {
  std::array<bool, 6> wanted{};
  for (const std::string& name : options.metrics)
    for (size_t i = 0; i < kMetrics.size(); ++i)
      if (name == kMetrics[i].name || (name == "all" && applicable(kMetrics[i], image))) wanted[i] = true;
  for (size_t i = 0; i < kMetrics.size(); ++i)
    if (options.limits[i]) wanted[i] = true;
  if (!options.diff.empty()) wanted[metric_index(options.diff_metric)] = true;
  return wanted;
}

/// A limit from the command line and the measured value.
struct Check {
  std::string name;
  double limit = 0.0, value = 0.0;
  bool passed = false;
};

std::vector<Check> check_limits(const CompareOptions& options, const ImagePair& pair,
                                const std::array<std::optional<double>, 6>& values) {
  std::vector<Check> checks;
  for (size_t i = 0; i < kMetrics.size(); ++i)
    if (options.limits[i]) {
      const double limit = *options.limits[i], value = *values[i];
      checks.push_back(
          {kMetrics[i].name, limit, value, kMetrics[i].higher_is_better ? value >= limit : value <= limit});
    }
  if (options.max_mismatch) {
    const double value = static_cast<double>(pair.mismatched) / static_cast<double>(pair.test.size.pixels());
    checks.push_back({"mismatch", *options.max_mismatch, value, value <= *options.max_mismatch});
  }
  return checks;
}

nlohmann::json to_json(const CompareOptions& options, const ImagePair& pair,
                       const std::array<std::optional<double>, 6>& values, const std::vector<Check>& checks) {
  nlohmann::json metrics = nlohmann::json::object(), limits = nlohmann::json::array();
  for (size_t i = 0; i < kMetrics.size(); ++i)
    if (values[i]) metrics[kMetrics[i].json_name] = *values[i]; // infinity (the PSNR of equal images) becomes null
  for (const Check& check : checks)
    limits.push_back({{"name", check.name}, {"limit", check.limit}, {"value", check.value}, {"passed", check.passed}});
  return {{"verb", "compare"},
          {"test", options.test},
          {"reference", options.reference},
          {"layer", pair.layer},
          {"width", pair.test.size.width},
          {"height", pair.test.size.height},
          {"channels", pair.test.channels},
          {"compared_pixels", pair.compared},
          {"mismatched_pixels", pair.mismatched},
          {"identical", pair.mismatched == 0 && pair.test.data == pair.reference.data},
          {"metrics", metrics},
          {"limits", limits},
          {"passed", std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.passed; })}};
}

void print_results(const ImagePair& pair, const std::array<std::optional<double>, 6>& values,
                   const std::vector<Check>& checks) {
  std::string text;
  for (size_t i = 0; i < kMetrics.size(); ++i)
    if (values[i]) text += fmt::format("{:<5} {:.6g}{}\n", kMetrics[i].name, *values[i], i == 2 ? " dB" : "");
  text += fmt::format("{} of {} pixels compared\n", pair.compared, pair.test.size.pixels());
  for (const Check& check : checks)
    text += fmt::format("limit {} {:.6g}: {}\n", check.name, check.limit, check.passed ? "ok" : "EXCEEDED");
  std::fwrite(text.data(), 1, text.size(), stdout);
}

void print_notes(const ImagePair& pair, const GlobalOptions& globals) {
  Diagnostics notes;
  if (pair.mismatched > 0)
    notes.report(Severity::kWarning, {},
                 fmt::format("{} pixels have a value in only one image; metrics ignore them", pair.mismatched));
  if (pair.alpha_ignored) notes.report(Severity::kNote, {}, "alpha channels are not compared");
  report_diagnostics(notes, globals);
}

int run_compare(const CompareOptions& options, const GlobalOptions& globals) {
  const auto is_scene = [](const std::string& file) {
    const std::string ending = ending_of(file);
    return ending == ".ptk" || ending == ".pbrt" || scene_format(file) != SceneFormat::kPbrt;
  };
  if (is_scene(options.test) || is_scene(options.reference))
    return compare_geometry(options.test, options.reference, options.samples, options.scene, globals);
  if (const std::vector<std::string> words = scene_words(options.scene); !words.empty())
    throw Error(ErrorKind::kUsage, words[0] + " only applies to scenes and mesh files");
  if (!options.diff.empty() && ending_of(options.diff) != ".png")
    throw Error(ErrorKind::kUsage, "--diff " + options.diff + ": the file name must end in .png");
  JsonOutput json(globals.json, globals.force);
  std::optional<OutputFile> diff;
  if (!options.diff.empty()) diff.emplace(options.diff, globals.force);

  refuse_to_replace({options.test, options.reference});
  const ImagePair pair = load_pair(options, globals.memory);
  print_notes(pair, globals);
  const std::array<bool, 6> wanted = wanted_metrics(options, pair.test);
  std::array<std::optional<double>, 6> values;
  for (size_t i = 0; i < kMetrics.size(); ++i) {
    if (!wanted[i]) continue;
    const bool shown = diff && i == metric_index(options.diff_metric);
    const Metric metric = compute(i, pair, options, shown);
    values[i] = metric.value;
    if (shown)
      diff->write(encode_png(heat_map(pair.test.size, metric.error_map.data, options.diff_white), PngTransfer::kRaw));
  }

  const std::vector<Check> checks = check_limits(options, pair, values);
  if (!globals.quiet && !json.to_stdout()) print_results(pair, values, checks);
  if (diff) {
    diff->commit();
    if (!globals.quiet && !json.to_stdout()) print_printable("wrote " + options.diff + "\n");
  }
  nlohmann::json document = to_json(options, pair, values, checks);
  const auto exceeded = std::ranges::find(checks, false, &Check::passed);
  if (exceeded == checks.end()) {
    json.write(document);
    return 0;
  }
  const Error error(ErrorKind::kLimitExceeded, fmt::format("{} is {:.6g}, beyond the limit {:.6g}", exceeded->name,
                                                           exceeded->value, exceeded->limit));
  document["error"] = error_json(error); // in addition to the measured values
  json.write(document);
  return report_error(error);
}

void add_limits(CLI::App& verb, CompareOptions& options) {
  const std::string group = "Limits (exit code 5 if one is exceeded)";
  constexpr double kHuge = 1e30;
  verb.add_option("--max-rmse", options.limits[0], "Maximum root mean squared error; 0 means equal images")
      ->check(number_in(0.0, kHuge))
      ->group(group);
  verb.add_option("--max-mae", options.limits[1], "Maximum mean absolute error; 0 means equal images")
      ->check(number_in(0.0, kHuge))
      ->group(group);
  verb.add_option("--min-psnr", options.limits[2],
                  "Minimum peak signal-to-noise ratio in dB, for the peak value 1; larger is better")
      ->check(number_in(-kHuge, kHuge))
      ->group(group);
  verb.add_option("--min-ssim", options.limits[3], "Minimum structural similarity, -1..1; 1 means equal images")
      ->check(number_in(-1.0, 1.0))
      ->group(group);
  verb.add_option("--max-flip", options.limits[4], "Maximum mean FLIP difference, 0..1; 0 means equal images")
      ->check(number_in(0.0, 1.0))
      ->group(group);
  verb.add_option("--max-p99", options.limits[5],
                  "Maximum absolute error of 99 % of the pixels; 0 means that they are equal")
      ->check(number_in(0.0, kHuge))
      ->group(group);
  verb.add_option("--max-mismatch", options.max_mismatch,
                  "Maximum fraction of pixels that have a value in only one image, 0..1")
      ->check(number_in(0.0, 1.0))
      ->group(group);
}

} // namespace

void add_compare_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<CompareOptions>();
  CLI::App& verb = add_verb(app, globals, "compare",
                            "Compute image metrics between two images, or distances between a baked file and its scene",
                            [options, &globals] { return run_compare(*options, globals); });
  verb.add_option("TEST", options->test, "Image to check, .png (decoded from sRGB to linear) or .exr; or a .ptk file")
      ->required();
  verb.add_option("REFERENCE", options->reference,
                  "Reference image of the same size; or the .pbrt scene of the .ptk file")
      ->required();
  verb.add_option("--layer", options->layer,
                  "EXR layer to compare (default: ao, else the colour channels, else the only layer)");
  verb.add_option("--metric", options->metrics,
                  "Metrics to compute, separated by commas. all computes every metric that applies to the images; ssim "
                  "needs 11 x 11 pixels, flip 1 or 3 channels (default all)")
      ->delimiter(',')
      ->check(one_of({"all", "rmse", "mae", "psnr", "ssim", "flip", "p99"}))
      ->default_str("all");
  verb.add_option(
          "--ppd", options->pixels_per_degree,
          "Pixels per degree of visual angle for flip, 0.001..1000 (default 67.0206, for a 0.7 m wide 4K screen "
          "seen from 0.7 m). Smaller values mean a closer observer, who sees more differences")
      ->check(number_in(1e-3, 1000.0))
      ->capture_default_str();

  verb.add_option("--samples", options->samples,
                  "Points to sample on each surface of a .ptk file and its scene, 1..1e9 (default 200000)")
      ->check(number_in(1.0, 1e9))
      ->type_name("N");

  add_limits(verb, *options);
  verb.add_option("--diff", options->diff,
                  "Write a .png with the error per pixel, from black (0) over red and yellow to white (--diff-white)")
      ->type_name("FILE");
  verb.add_option("--diff-metric", options->diff_metric, "Metric that --diff shows (default mae)")
      ->check(one_of({"rmse", "mae", "psnr", "ssim", "flip", "p99"}))
      ->capture_default_str();
  verb.add_option("--diff-white", options->diff_white,
                  "Error that --diff shows as white, 1e-6..1e6 (default 0.25). Lower it to see small errors")
      ->check(number_in(1e-6, 1e6))
      ->capture_default_str();
  add_scene_options(verb, options->scene);
  verb.footer("Pixels without a value (ambient occlusion where no surface is hit) are ignored.\n"
              "Examples:\n"
              "  packtrace compare test.exr truth.exr --layer ao --min-psnr 34\n"
              "  packtrace compare test.png truth.png --diff errors.png --diff-white 0.05\n"
              "  packtrace compare house.ptk house.pbrt");
}

} // namespace packtrace
