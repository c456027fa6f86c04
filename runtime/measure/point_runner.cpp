#include "runtime/measure/point_runner.h"

#include <algorithm>
#include <fstream>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/measure/histogram.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

Words operator+(Words a, const Words& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Json read_report(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  Json document = Json::parse(in, nullptr, false);
  if (document.is_discarded()) throw Error(ErrorKind::kIo, file.string() + ": cannot be read");
  return document;
}

/// Streams of a file on disk, largest first.
Json stream_list(const Json& bake) {
  std::vector<std::pair<std::string, uint64_t>> streams;
  const Json& disk = bake.at("disk");
  const Json& by_name = disk.contains("streams") ? disk.at("streams") : bake.at("bytes");
  uint64_t sum = 0;
  for (const auto& [name, bytes] : by_name.items())
    if (name != "total" && bytes.get<uint64_t>() > 0) {
      streams.emplace_back(name, bytes.get<uint64_t>());
      sum += bytes.get<uint64_t>();
    }
  const auto total = disk.at("bytes").get<uint64_t>();
  if (total > sum) streams.emplace_back("other", total - sum);
  std::ranges::stable_sort(streams, [](const auto& a, const auto& b) { return a.second > b.second; });
  Json list = Json::array();
  for (const auto& [name, bytes] : streams) list.push_back({{"name", name}, {"bytes", bytes}});
  return list;
}

double finest_step(const Json& bake) {
  double step = 0.0;
  for (const Json& grid : bake.at("grids"))
    if (const auto s = grid.at("step").get<double>(); step == 0.0 || s < step) step = s;
  return step;
}

RenderKnobs reference_knobs(uint32_t spp) {
  RenderKnobs knobs;
  knobs.spp = spp, knobs.backend = "embree";
  return knobs;
}

/// All values of a point that a failed one lacks.
void add_nulls(Json& point) {
  for (const char* name : {"bytes", "resident_bytes", "position", "distance", "normal", "triangles", "ao", "seconds",
                           "cpu_seconds", "peak_bytes", "mrays_per_s", "embree", "speed_ratio", "ms_per_frame",
                           "histograms", "worst_geometries", "traced_triangles", "isa"})
    point[name] = nullptr;
}

} // namespace

nlohmann::json to_json(const StageFailure& failure) {
  return {{"stage", failure.stage},
          {"exit_code", failure.child.signal ? Json() : Json(failure.child.exit_code)},
          {"signal", failure.child.signal ? Json(failure.child.signal) : Json()},
          {"message", failure.child.error}};
}

std::string status_of(const StageFailure& failure) {
  const bool memory = failure.child.error.find("--max-memory") != std::string::npos ||
                      failure.child.error.find("not enough memory") != std::string::npos;
  return failure.child.signal ? "killed" : memory ? "out-of-memory" : "failed";
}

PointRunner::PointRunner(RunnerConfig config, const MeasureFolder& folder)
    : config_(std::move(config)), folder_(folder) {}

PointRunner::~PointRunner() {
  std::error_code ignored; // nothing is lost if files stay
  fs::remove_all(folder_ / "work", ignored);
}

Words render_words(const RenderKnobs& knobs, const RunnerConfig& config) {
  const bool other = knobs.denoise && config.denoiser != RunnerConfig().denoiser;
  return words_of(knobs) + (other ? Words{"--denoiser", config.denoiser} : Words{}) +
         (knobs.backend == RenderKnobs().backend ? config.tracer : Words{});
}

std::string PointRunner::key(const MeasurePoint& point) const {
  return key_of(config_.identity + commands(point).dump() +
                fmt::format(" {}x{} {} {} {} {} {}", config_.size.width, config_.size.height,
                            config_.camera.value_or(""), config_.seed, config_.noise_seed, config_.distance_samples,
                            config_.embree_beside_each_point));
}

nlohmann::json PointRunner::commands(const MeasurePoint& point) const {
  const std::string stem = fs::path(config_.scene).stem().string(), file = stem + ".ptk";
  return {{"bake", shell_command(Words{"packtrace", "bake", config_.scene, "-o", file} + words_of(point.bake) +
                                 config_.bake_options + config_.scene_options)},
          {"render", shell_command(Words{"packtrace", "render", file, "-o", stem + ".exr", "--size",
                                         fmt::format("{}x{}", config_.size.width, config_.size.height)} +
                                   render_words(point.render, config_) +
                                   (config_.camera ? Words{"--camera", *config_.camera} : Words{}) +
                                   (config_.seed ? Words{"--seed", std::to_string(config_.seed)} : Words{}))}};
}

/// Runs a command and returns its JSON, with the time of the process added. Throws StageFailure.
nlohmann::json PointRunner::run(const std::string& stage, Words words) {
  const fs::path report = folder_ / "work/report.json";
  words = words + Words{"-q", "--force", "--json", report.string()} + config_.common;
  const ChildResult child = run_child(words);
  if (!child.ok()) throw StageFailure{stage, child};
  Json json = read_report(report);
  json["process_seconds"] = child.seconds, json["cpu_seconds"] = child.cpu_seconds;
  return json;
}

nlohmann::json PointRunner::render(const std::string& stage, const std::string& input, const fs::path& output,
                                   uint64_t seed, const Words& options) {
  Words words{"render", input,
              "-o",     output.string(),
              "--size", fmt::format("{}x{}", config_.size.width, config_.size.height),
              "--seed", std::to_string(seed)};
  if (config_.camera) words = words + Words{"--camera", *config_.camera};
  return run(stage, words + options);
}

nlohmann::json PointRunner::make_reference() {
  const Words options = render_words(reference_knobs(config_.spp), config_) + config_.scene_options;
  const auto command = [&](uint64_t seed) {
    return shell_command(Words{"packtrace", "render", config_.scene, "-o", "float.exr", "--size",
                               fmt::format("{}x{}", config_.size.width, config_.size.height), "--seed",
                               std::to_string(seed)} +
                         options + (config_.camera ? Words{"--camera", *config_.camera} : Words{}));
  };
  const Json commands{command(config_.seed), command(config_.noise_seed)};
  const std::string key = key_of(config_.identity + commands.dump());
  const fs::path noise_file = folder_ / "reference/noise.exr";
  std::optional<Json> known = folder_.load("reference-" + key);
  if (!known || !fs::exists(reference_file()) || !fs::exists(noise_file)) {
    try {
      fs::create_directories(folder_ / "work");
      const Json first =
          render("reference", config_.scene, reference_file(), config_.seed, options + Words{"--aov", "ao,instance"});
      render("reference", config_.scene, noise_file, config_.noise_seed, options + Words{"--aov", "ao"});
      known = {{"commands", commands},
               {"mean_ao", first.at("mean_ao")},
               {"hit_pixels", first.at("hit_pixels")},
               {"ao_radius", first.at("ao_radius")},
               {"camera", first.at("camera")},
               {"embree",
                {{"mrays_per_s",
                  {{"camera", first.at("/mrays_per_s/primary"_json_pointer)},
                   {"ao", first.at("/mrays_per_s/ao"_json_pointer)}}},
                 {"seconds",
                  {{"load", first.at("/seconds/load"_json_pointer)}, {"bvh", first.at("/seconds/bvh"_json_pointer)}}},
                 {"resident_bytes", first.at("/resident_bytes/tracing"_json_pointer)},
                 {"peak_bytes", first.at("peak_rss_bytes")}}}};
      folder_.save("reference-" + key, *known);
    } catch (const StageFailure& failure) {
      const int code = failure.child.exit_code;
      throw Error(code >= 2 && code <= 7 ? static_cast<ErrorKind>(code) : ErrorKind::kInput,
                  "rendering the float reference failed: " + failure.child.error);
    }
  }
  reference_ = read_ao(reference_file());
  Json floor = ao_error(read_ao(noise_file), *reference_);
  noise_mae_ = floor.at("mae").is_null() ? 0.0 : floor.at("mae").get<double>();
  add_noise_ratio(floor);
  (*known)["noise_floor"] = floor;
  return *known;
}

void PointRunner::add_noise_ratio(nlohmann::json& ao) const {
  if (noise_mae_ > 0.0 && !ao.at("mae").is_null()) ao["noise_ratio"] = ao.at("mae").get<double>() / noise_mae_;
}

void PointRunner::bake(const BakeKnobs& knobs) {
  if (baked_ == knobs) return;
  baked_.reset();
  const std::string file = folder_ / "work/point.ptk";
  fs::create_directories(folder_ / "work");
  bake_report_ = run("bake", Words{"bake", config_.scene, "-o", file} + words_of(knobs) + config_.bake_options +
                                 config_.scene_options);
  baked_ = knobs;
  BakeKnobs surfaces = knobs; // codec, trees and levels do not change level 0, so comparisons are shared
  surfaces.codec = BakeKnobs{}.codec, surfaces.trees = BakeKnobs{}.trees, surfaces.lod = BakeKnobs{}.lod;
  const auto known = std::ranges::find(comparisons_, surfaces, &std::pair<BakeKnobs, Json>::first);
  if (known != comparisons_.end()) {
    comparison_ = known->second;
    return;
  }
  baked_.reset(); // until it is compared
  comparison_ =
      run("compare", Words{"compare", file, config_.scene, "--samples", std::to_string(config_.distance_samples)} +
                         config_.scene_options);
  comparisons_.emplace_back(surfaces, comparison_);
  baked_ = knobs;
}

void PointRunner::add_file_values(nlohmann::json& point) const {
  const Json& b = bake_report_;
  const auto bytes = b.at("/disk/bytes"_json_pointer).get<uint64_t>();
  const auto triangles = b.at("triangles").get<double>();
  point["bytes"] = {{"file", bytes},
                    {"memory", b.at("/bytes/total"_json_pointer)},
                    {"per_triangle", triangles > 0 ? Json(static_cast<double>(bytes) / triangles) : Json()},
                    {"streams", stream_list(b)}};
  const auto max = b.at("max_position_error").get<double>();
  point["position"] = {{"max", max},
                       {"rms", b.at("rms_position_error")},
                       {"max_of_diagonal", config_.diagonal > 0.0 ? Json(max / config_.diagonal) : Json()},
                       {"grid_step", finest_step(b)}};
  point["distance"] = comparison_.at("distance");
  point["normal"] = comparison_.at("normal");
  point["normal"]["max_degrees"] = b.at("max_normal_error_degrees");
  point["normal"]["mean_degrees"] = b.at("mean_normal_error_degrees");
  point["triangles"] = {{"stored", b.at("triangles")},
                        {"placed", b.at("placed_triangles")},
                        {"collapsed", b.at("collapsed_triangles")},
                        {"coinciding", b.at("coinciding_triangles")}};
  point["histograms"] = comparison_.at("histograms");
  point["worst_geometries"] = comparison_.at("worst_geometries");
}

void PointRunner::add_render_values(nlohmann::json& point, const MeasurePoint& what) {
  const std::string file = folder_ / "work/point.ptk";
  const fs::path image = folder_.image(key(what));
  const Json r = render("render", file, image, config_.seed, render_words(what.render, config_) + Words{"--aov", "ao"});
  const auto at = [&](const char* path) { return r.at(Json::json_pointer(path)).get<double>(); };
  const double frames = what.render.frames, open = at("/seconds/load"), bvh = at("/seconds/bvh");
  point["resident_bytes"] = r.at("/resident_bytes/tracing"_json_pointer);
  point["traced_triangles"] =
      r.contains("lod") ? r.at("/lod/traced_triangles"_json_pointer) : bake_report_.at("placed_triangles");
  point["seconds"] = {{"import", bake_report_.at("/seconds/import"_json_pointer)},
                      {"bake", bake_report_.at("/seconds/bake"_json_pointer)},
                      {"open", open},
                      {"bvh", bvh},
                      {"first_ray", open + bvh},
                      {"render", r.at("process_seconds")}};
  point["cpu_seconds"] = {{"bake", bake_report_.at("cpu_seconds")}, {"render", r.at("cpu_seconds")}};
  point["peak_bytes"] = {{"bake", bake_report_.at("peak_rss_bytes")}, {"render", r.at("peak_rss_bytes")}};
  point["mrays_per_s"] = {{"camera", at("/mrays_per_s/primary")}, {"ao", at("/mrays_per_s/ao")}};
  point["ms_per_frame"] = {{"camera", at("/seconds/primary") * 1e3},
                           {"ao", at("/seconds/ao") * 1e3 / frames},
                           {"denoise", what.render.denoise ? at("/seconds/denoise") * 1e3 / frames : 0.0},
                           {"upsample", at("/seconds/upsample") * 1e3}};
  point["isa"] = r.at("isa");
  point["embree"] = point["speed_ratio"] = nullptr;
  if (config_.embree_beside_each_point && what.render.backend == "packed" && !what.render.lod_error_px) {
    RenderKnobs embree = what.render;
    embree.backend = "embree";
    const Json e = render("embree", file, folder_ / "work/embree.exr", config_.seed,
                          render_words(embree, config_) + Words{"--aov", "ao"});
    const double camera = e.at("/mrays_per_s/primary"_json_pointer).get<double>(),
                 ao = e.at("/mrays_per_s/ao"_json_pointer).get<double>();
    point["embree"] = {{"camera", camera}, {"ao", ao}};
    point["speed_ratio"] = {{"camera", camera > 0 ? Json(at("/mrays_per_s/primary") / camera) : Json()},
                            {"ao", ao > 0 ? Json(at("/mrays_per_s/ao") / ao) : Json()}};
  }
  const AoImage ao = read_ao(image);
  point["ao"] = ao_error(ao, *reference_);
  add_noise_ratio(point["ao"]);
  std::vector<double> errors;
  for (size_t i = 0; i < ao.valid.size(); ++i)
    if (ao.valid[i] && reference_->valid[i])
      errors.push_back(
          std::abs(static_cast<double>(ao.image.data[i]) - static_cast<double>(reference_->image.data[i])));
  point["histograms"]["ao"] = to_json(make_histogram(errors, "occlusion"));
}

bool PointRunner::is_measured(const MeasurePoint& point) const {
  const std::string name = key(point);
  return folder_.load(name) && fs::exists(folder_.image(name));
}

nlohmann::json PointRunner::measure(const MeasurePoint& what) {
  const std::string name = key(what);
  if (is_measured(what)) {
    std::optional<Json> known = folder_.load(name);
    (*known)["reused"] = true;
    for (const auto& [field, value] : {std::pair{"id", what.id}, {"label", what.label}, {"group", what.group}})
      (*known)[field] = value;
    return *known;
  }
  Json point{{"id", what.id},
             {"label", what.label},
             {"group", what.group},
             {"status", "ok"},
             {"error", nullptr},
             {"reused", false},
             {"knobs", to_json(what.bake, what.render)},
             {"commands", commands(what)}};
  add_nulls(point);
  try {
    bake(what.bake);
    if (what.render.lod_error_px && bake_report_.at("lod").is_null()) {
      point["status"] = "not-applicable";
      return point;
    }
    add_file_values(point);
    add_render_values(point, what);
    folder_.save(name, point);
  } catch (const StageFailure& failure) {
    if (failure.child.exit_code == static_cast<int>(ErrorKind::kIo))
      throw Error(ErrorKind::kIo, fmt::format("{} of point {} failed: {}; the same command continues", failure.stage,
                                              what.id, failure.child.error));
    point["status"] = status_of(failure);
    point["error"] = to_json(failure);
  }
  return point;
}

nlohmann::json PointRunner::load_or_fill(const std::string& kind, const BakeKnobs& knobs, size_t entries,
                                         const std::function<void(nlohmann::json& array)>& fill) {
  const std::string name = kind + "-" + key({"", "", "", knobs, {}}) + fmt::format("-{}-{}", config_.spp, entries);
  if (std::optional<Json> known = folder_.load(name)) return *known;
  Json array = Json::array();
  try {
    bake(knobs);
    fill(array);
  } catch (const StageFailure&) {
    return Json::array();
  }
  folder_.save(name, array);
  return array;
}

nlohmann::json PointRunner::convergence(const BakeKnobs& bake_knobs, const std::vector<uint32_t>& frames) {
  const fs::path image = folder_ / "work/frames.exr";
  return load_or_fill(config_.denoiser == "ours" ? "convergence" : "convergence-" + config_.denoiser, bake_knobs,
                      frames.size(), [&](Json& curve) {
                        for (const uint32_t count : frames) {
                          Json entry{{"frames", count}, {"spp", 1}};
                          for (const bool denoise : {false, true}) {
                            RenderKnobs knobs;
                            knobs.frames = count, knobs.denoise = denoise;
                            const Json r = render("render", folder_ / "work/point.ptk", image, config_.noise_seed,
                                                  render_words(knobs, config_) + Words{"--aov", "ao"});
                            Json& ao = entry[denoise ? "denoised" : "noisy"];
                            ao = ao_error(read_ao(image), *reference_);
                            add_noise_ratio(ao);
                            entry["ms_per_frame"]["ao"] = r.at("/seconds/ao"_json_pointer).get<double>() * 1e3 / count;
                            if (denoise)
                              entry["ms_per_frame"]["denoise"] =
                                  r.at("/seconds/denoise"_json_pointer).get<double>() * 1e3 / count;
                          }
                          curve.push_back(entry);
                        }
                      });
}

nlohmann::json PointRunner::resolution(const BakeKnobs& bake_knobs, const std::vector<uint32_t>& samples) {
  const fs::path image = folder_ / "work/resolution.exr";
  std::set<std::pair<std::string, uint32_t>> what;
  for (const uint32_t spp : samples) {
    what.emplace("full", spp);
    what.emplace("quarter", spp);
    what.emplace("quarter", 4 * spp);
  }
  return load_or_fill("resolution", bake_knobs, samples.size(), [&](Json& table) {
    for (const auto& [resolution, spp] : what) {
      RenderKnobs knobs;
      knobs.spp = spp, knobs.ao_resolution = resolution;
      const Json r = render("render", folder_ / "work/point.ptk", image, config_.noise_seed,
                            render_words(knobs, config_) + Words{"--aov", "ao"});
      Json ao = ao_error(read_ao(image), *reference_);
      add_noise_ratio(ao);
      table.push_back({{"ao_resolution", resolution},
                       {"spp", spp},
                       {"rays", r.at("/rays/ao"_json_pointer)},
                       {"ao", ao},
                       {"ms",
                        {{"ao", r.at("/seconds/ao"_json_pointer).get<double>() * 1e3},
                         {"upsample", r.at("/seconds/upsample"_json_pointer).get<double>() * 1e3}}}});
    }
  });
}

} // namespace packtrace
