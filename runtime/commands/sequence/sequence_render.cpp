#include "runtime/commands/sequence/sequence_render.h"

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/with_file.h"
#include "runtime/commands/cli/binary_output.h"
#include "runtime/commands/render/denoiser_options.h"
#include "runtime/commands/render/render_setup.h"
#include "runtime/commands/sequence/sequence_checkpoint.h"
#include "runtime/commands/sequence/sequence_outputs.h"
#include "runtime/commands/sequence/sequence_report.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

/// Default of --checkpoint: seconds between two checkpoints. Work after the last one is repeated.
constexpr double kCheckpointInterval = 10.0;

/// The table of --csv, written line by line.
class CsvOutput {
public:
  CsvOutput(const std::optional<std::string>& file, bool force) {
    if (!file) return;
    output_.emplace(*file, force);
    stream_ = std::fopen(output_->path().c_str(), "wb");
    if (stream_ == nullptr) throw Error(ErrorKind::kIo, *file + ": cannot be written");
    write(csv_header());
  }
  ~CsvOutput() {
    if (stream_ != nullptr) std::fclose(stream_);
  }
  CsvOutput(const CsvOutput&) = delete;
  CsvOutput& operator=(const CsvOutput&) = delete;

  void write(const std::string& line) {
    if (stream_ != nullptr && std::fputs(line.c_str(), stream_) < 0) fail();
  }
  void commit() {
    if (stream_ == nullptr) return;
    if (std::fclose(std::exchange(stream_, nullptr)) != 0) fail();
    output_->commit();
  }

private:
  [[noreturn]] void fail() const { throw Error(ErrorKind::kIo, output_->target().string() + ": cannot be written"); }
  std::optional<OutputFile> output_;
  std::FILE* stream_ = nullptr;
};

/// Describes the content of a file by its size and the time of its last change.
nlohmann::json version_of(const std::string& file) {
  std::error_code error; // of a file that vanished meanwhile
  const uintmax_t bytes = std::filesystem::file_size(file, error);
  return {file, bytes, std::filesystem::last_write_time(file, error).time_since_epoch().count()};
}

/// All values of a configuration, by name.
nlohmann::json ao_values(const AoConfig& config) {
  nlohmann::json values = {{"seed", config.seed}, {"sampler", static_cast<int>(config.sampler)}};
  for (const Setting<AoConfig>& setting : ao_settings()) values[std::string(setting.info.name)] = setting.get(config);
  return values;
}

/// Describes everything on which the pictures depend, for SequenceCheckpoint.
std::string settings_text(const RenderOptions& options, const RenderSetup& setup, const Sequence& sequence) {
  const StillConfig& c = setup.config;
  const LodOptions& lod = options.lod;
  nlohmann::json text = {
      {"path", *options.sequence.path},
      {"pictures", sequence.pictures},
      {"fps", sequence.fps},
      {"subframes", sequence.subframes},
      {"start", sequence.start_s},
      {"size", {c.size.width, c.size.height, c.supersample}},
      {"denoiser", {options.denoiser, options.denoiser_settings}},
      {"jitter", c.jitter},
      {"resolution", {options.ao.resolution, options.ao.rate}},
      {"ao", ao_values(c.ao)},
      {"camera", options.camera.value_or("")},
      {"backend", options.backend.value_or("")},
      {"gpu_device", options.gpu_device.value_or("")},
      {"bvh", options.bvh.value_or("")},
      {"fast_edges", options.fast_edges},
      {"lod",
       {lod.error_px.value_or(0.0), lod.scheme.value_or(""), lod.traced_ratio.value_or(-1.0),
        lod.culled_scale.value_or(0.0), lod.tolerance.value_or(0), lod.rays.value_or(""), lod.cull.value_or("")}},
      {"shade", {options.shade.view, options.shade.exposure, options.shade.tone_map, options.shade.settings}},
      {"layers", options.aovs},
      {"background", options.background.value_or("")},
      {"legend", !options.no_legend},
      {"world", options.scene.world.value_or(1)},
      {"input", version_of(options.input)}};
  if (options.scene.time) text["time"] = *options.scene.time;
  if (options.sequence.keys) text["keys"] = version_of(*options.sequence.keys);
  std::string first_and_last;
  for (const uint64_t picture : {uint64_t{0}, sequence.pictures / 2, sequence.pictures - 1}) {
    const DAffine& world = sequence.camera(picture).world_from_camera;
    for (int column = 0; column < 4; ++column)
      first_and_last += fmt::format("{} {} {} ", world[column].x, world[column].y, world[column].z);
  }
  text["cameras"] = first_and_last;
  return text.dump();
}

/// Continues from the checkpoint. Returns the number of the first picture to render.
uint64_t resume_sequence(const SequenceCheckpoint& checkpoint, const Sequence& sequence, FrameLoop& loop) {
  const std::optional<SequenceState> state = checkpoint.load();
  if (!state || state->pictures == 0) return 0;
  if (state->pictures > sequence.pictures) throw Error(ErrorKind::kInput, checkpoint.file() + ": damaged");
  loop.restore(sequence.camera(state->pictures - 1), sequence.time_s(state->pictures - 1), state->frame);
  return state->pictures;
}

/// Renders and writes the pictures from `first` on. Returns their reports.
std::vector<PictureRow> render_pictures(const Sequence& sequence, uint64_t first, RenderSetup& setup,
                                        SequenceOutputs& outputs, CsvOutput& csv, const SequenceCheckpoint* checkpoint,
                                        double checkpoint_s, Progress& progress) {
  FrameLoop& loop = *setup.loop;
  const ExrAttributes attributes = render_attributes(setup.config, sequence.subframes);
  std::vector<PictureRow> rows;
  RenderedImage image;
  Stopwatch since_checkpoint;
  progress.begin("pictures", (sequence.pictures - first) * sequence.subframes * loop.frame_pixels());
  for (uint64_t picture = first; picture < sequence.pictures; ++picture) {
    const PictureReport report =
        render_picture(loop, sequence.camera(picture), sequence.time_s(picture), sequence.subframes, image, progress);
    const Stopwatch writing;
    outputs.write(picture, sequence.fps, image, attributes);
    PictureRow row(picture, sequence.time_s(picture), report, loop.detail());
    row.write_s = writing.seconds();
    csv.write(csv_line(row));
    rows.push_back(row);
    if (checkpoint == nullptr || since_checkpoint.seconds() < checkpoint_s) continue;
    checkpoint->save({picture + 1, loop.save()});
    since_checkpoint = Stopwatch();
  }
  return rows;
}

/// Frames the whole scene if its own camera, with which the path begins, sees nothing of it.
void replace_blind_camera(RenderSetup& setup, const RenderOptions& options, const GlobalOptions& globals,
                          Progress& progress) {
  FrameLoop& loop = *setup.loop;
  const SceneMotion* const motion = loop.scene().motion;
  if (options.camera || !setup.camera.index || !begins_with_still_camera(options.sequence, *setup.camera.index, motion))
    return;
  const bool seen = loop.next_frame(setup.camera.camera, start_time(options.sequence, motion), progress).seen;
  loop.reset();
  if (!seen) setup.camera = frame_whole_scene(setup.camera, *setup.loaded.source, setup.config.size, options, globals);
}

void check_sequence(const RenderOptions& options, const SequenceOutputs& outputs, const JsonOutput& json,
                    const DetailConfig& detail) {
  if (options.ground_truth) throw Error(ErrorKind::kUsage, "--ground-truth renders stills; it does not go with --path");
  refuse_shared_stdout(outputs.to_stdout(), json);
  require_denoiser_for(outputs.layers(), denoises(options));
  require_shading_for(outputs.layers(), options);
  if (has_lod_layer(outputs.layers()) && !detail.camera_uses_levels())
    throw Error(ErrorKind::kUsage, "the layers lod and lod-error require --lod-error and --lod-rays all");
}

} // namespace

int render_sequence(const RenderOptions& options, const GlobalOptions& globals) {
  if (options.outputs.empty()) fail_without_output("render", options.input, "_%04d.png");
  tracer_config(options, globals, false); // reports wrong options before any work
  JsonOutput json(globals.json, globals.force);
  const DetailConfig detail = detail_config(options.lod, false);
  SequenceOutputs outputs(options.outputs, options.aovs, available_layers(options, detail), globals.force,
                          preview_style(options), options.sequence);
  check_sequence(options, outputs, json, detail);
  CsvOutput csv(options.sequence.csv, globals.force);
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  RenderSetup setup(options, globals, detail, outputs.layers(), progress, display);
  const Sequence sequence = with_file(options.input, [&] {
    replace_blind_camera(setup, options, globals, progress);
    return make_sequence(options.sequence, options.frames, *setup.loaded.source, setup.camera.camera,
                         setup.camera.index, *setup.loop, globals.memory);
  });
  outputs.check(sequence.pictures);
  std::optional<SequenceCheckpoint> checkpoint;
  if (const auto name = outputs.checkpoint_name()) checkpoint.emplace(*name, settings_text(options, setup, sequence));
  const uint64_t first =
      options.sequence.resume && checkpoint ? resume_sequence(*checkpoint, sequence, *setup.loop) : 0;
  const std::vector<PictureRow> rows =
      render_pictures(sequence, first, setup, outputs, csv, checkpoint ? &*checkpoint : nullptr,
                      options.sequence.checkpoint.value_or(kCheckpointInterval), progress);
  outputs.commit();
  csv.commit();
  if (checkpoint) checkpoint->remove();
  display.finish();

  const nlohmann::json result = {{"verb", "render"},
                                 {"input", options.input},
                                 {"files", outputs.targets()},
                                 {"width", setup.config.size.width},
                                 {"height", setup.config.size.height},
                                 {"denoiser", denoiser_json(setup.config.denoise, setup.config.denoiser)},
                                 {"load_s", setup.load_s},
                                 {"peak_rss_bytes", peak_rss_bytes()},
                                 {"sequence", sequence_json(sequence, rows)}};
  if (json.wanted()) json.write(result);
  if (json.to_stdout() || globals.quiet) return 0;
  std::FILE* const text = outputs.to_stdout() ? stderr : stdout;
  fmt::print(text, "{}x{} pixels, {}", setup.config.size.width, setup.config.size.height,
             sequence_text(result.at("sequence")));
  for (const std::string& file : outputs.targets()) print_printable("wrote " + file + "\n", text);
  return 0;
}

} // namespace packtrace
