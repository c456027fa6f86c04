#include "runtime/commands/commands.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/binary_output.h"
#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/cli/progress_display.h"
#include "runtime/commands/denoise/denoise_inputs.h"
#include "runtime/commands/denoise/denoise_options.h"
#include "runtime/commands/denoise/denoise_outputs.h"
#include "runtime/commands/denoise/denoise_report.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

PreviewStyle style_of(const DenoiseOptions& options) {
  PreviewStyle style;
  if (options.background) style.background = parse_background(*options.background);
  style.legend = !options.no_legend;
  return style;
}

/// Throws Error(kUsage) for a cut at a picture that is not there.
void check_cuts(const DenoiseOptions& options, const std::vector<NumberedInput>& inputs) {
  for (const uint64_t cut : options.cuts)
    if (cut < inputs.front().number || cut > inputs.back().number)
      throw Error(ErrorKind::kUsage,
                  fmt::format("--cut {}: the pictures are {} to {}", cut, inputs.front().number, inputs.back().number));
}

std::vector<DenoisedRow> denoise_pictures(const DenoiseOptions& options, const GlobalOptions& globals,
                                          const LayeredConfig& config, const std::vector<NumberedInput>& inputs,
                                          DenoiseOutputs& outputs, ProgressDisplay& display, Progress& progress) {
  LayeredDenoiser denoiser(config, globals.memory);
  const ExrAttributes attributes{{"comments", std::string("packtrace denoise")}};
  std::vector<DenoisedRow> rows;
  progress.begin("pictures", inputs.size());
  for (const NumberedInput& input : inputs) {
    const bool cut = std::ranges::find(options.cuts, input.number) != options.cuts.end();
    const LayeredResult& result = denoiser.next(input.file, cut);
    const Stopwatch writing;
    outputs.write(input, &input == &inputs.back(), result, config.reading.conventions, attributes);
    rows.emplace_back(input, result);
    rows.back().write_s = writing.seconds();
    for (const std::string& warning : picture_warnings(rows.back(), inputs.size() > 1, config.still)) {
      if (globals.quiet) continue;
      display.finish();
      print_printable(fmt::format("{}: warning: {}\n", input.file, warning), stderr);
    }
    progress.advance();
  }
  return rows;
}

int run(const DenoiseOptions& options, const GlobalOptions& globals) {
  if (options.outputs.empty())
    fail_without_output("denoise", options.inputs.front(), options.inputs.size() > 1 ? "_%04d.exr" : ".denoised.exr");
  LayeredConfig config = layered_config(options); // reports wrong options before any work
  JsonOutput json(globals.json, globals.force);
  const std::vector<NumberedInput> inputs = list_inputs(options.inputs, options.start, options.frames);
  check_cuts(options, inputs);
  DenoiseOutputs outputs(options.outputs, options.aovs, inputs, {false, config.denoise}, options.still, globals.force,
                         style_of(options));
  refuse_shared_stdout(outputs.to_stdout(), json);
  config.reading.all_channels = outputs.has_copies();
  config.view_layers = outputs.has_views();
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  const std::vector<DenoisedRow> rows = denoise_pictures(options, globals, config, inputs, outputs, display, progress);
  display.finish();
  const nlohmann::json result = denoise_json(rows, config, outputs.targets());
  if (json.wanted()) json.write(result);
  if (json.to_stdout() || globals.quiet) return 0;
  std::FILE* const text = outputs.to_stdout() ? stderr : stdout;
  fmt::print(text, "{}", denoise_text(result, globals.verbosity > 0));
  for (const std::string& file : outputs.targets()) print_printable("wrote " + file + "\n", text);
  return 0;
}

} // namespace

void add_denoise_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<DenoiseOptions>();
  CLI::App& verb = add_verb(app, globals, "denoise",
                            "Denoise ambient occlusion in EXR pictures of any renderer, single ones and sequences",
                            [options, &globals] { return run(*options, globals); });
  add_denoise_options(verb, *options);
}

} // namespace packtrace
