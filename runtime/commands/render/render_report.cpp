#include "runtime/commands/render/render_report.h"

#include <algorithm>
#include <cstdlib>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "compress/format/file/file_summary.h"
#include "runtime/commands/render/denoiser_options.h"
#include "runtime/commands/reports/file_report.h"
#include "runtime/commands/reports/seam_report.h"

namespace packtrace {
namespace {

double rate_m(uint64_t rays, double seconds) { return seconds > 0 ? static_cast<double>(rays) / seconds * 1e-6 : 0; }

/// Resident bytes by name, summed over tracers. Shared parts (the file, the threads' caches) count once.
nlohmann::json resident_parts(std::span<const RayTracer* const> tracers) {
  nlohmann::json parts = nlohmann::json::object();
  for (const RayTracer* tracer : tracers)
    for (const ResidentPart& part : tracer->resident()) {
      const std::string name(part.name);
      parts[name] = part.bytes + (part.shared ? 0 : parts.value(name, uint64_t{0}));
    }
  return parts;
}

uint64_t sum_of(const nlohmann::json& parts) {
  uint64_t bytes = 0;
  for (const auto& [name, part] : parts.items()) bytes += part.get<uint64_t>();
  return bytes;
}

std::string resident_text(const nlohmann::json& resident) {
  const auto mib = [](const nlohmann::json& bytes) { return bytes.get<double>() / (1 << 20); };
  std::string text = fmt::format("{:.1f} MiB", mib(resident.at("tracing")));
  const char* separator = " (";
  for (const auto& [name, bytes] : resident.at("parts").items()) {
    text += fmt::format("{}{} {:.1f}", separator, name, mib(bytes));
    separator = ", ";
  }
  return text + ")";
}

/// Reasons for the settings of a render, such as "--size" or "the camera's film".
struct Reasons {
  std::string camera, size, radius, backend, threads;
};

Reasons reasons_of(const SceneSource& source, const ChosenCamera& camera, const RenderOptions& options,
                   const StillConfig& config, bool baked, const GlobalOptions& globals) {
  const size_t cameras = source.cameras().size();
  Reasons reasons;
  reasons.camera = options.camera == "auto" ? "--camera auto, which shows the whole scene"
                   : !camera.reason.empty()
                       ? camera.reason + ", so the whole scene is shown"
                       : fmt::format("number {} of {}, counted from 0{}", camera.index.value_or(0), cameras,
                                     camera.index == 0u && cameras > 1 ? "; --camera selects another" : "");
  reasons.size = options.size.empty() ? (camera.index ? "the camera's film" : "the default") : "--size";
  reasons.radius =
      options.ao.radius ? "--ao-radius"
      : config.ao.radius == ao_radius({}, source.world_bounds())
          ? fmt::format("10 % of the scene's diagonal, {:.5g}", glm::length(source.world_bounds().extent()))
          : "--ao-set";
  reasons.backend = options.backend                     ? "--backend"
                    : !baked                            ? "default for .pbrt scenes, which are traced as floats"
                    : options.bvh || options.fast_edges ? "--bvh and --fast-edges select Embree"
                                                        : "default for .ptk files, which are traced as packed clusters";
  reasons.threads = globals.threads > 0         ? "--threads"
                    : thread_limit(globals) > 0 ? "PACKTRACE_THREADS"
                                                : "all hardware threads";
  return reasons;
}

std::string camera_text(const Camera& camera) {
  const DAffine& world = camera.world_from_camera;
  const DVec3 eye = transform_point(world, DVec3(0)), forward = transform_vector(world, DVec3(0, 0, 1));
  const auto vector = [](DVec3 v) { return fmt::format("({:.5g} {:.5g} {:.5g})", v.x, v.y, v.z); };
  switch (camera.projection) {
  case Projection::kPerspective:
    return fmt::format("perspective of {:.4g} degrees at {}, looking along {}", camera.fov_degrees, vector(eye),
                       vector(glm::normalize(forward)));
  case Projection::kOrthographic:
    return fmt::format("orthographic at {}, looking along {}", vector(eye), vector(glm::normalize(forward)));
  case Projection::kEnvironment:
    return "environment at " + vector(eye);
  }
  return {};
}

/// Describes the grids of the positions of a baked file.
std::string grid_text(const LoadedScene& loaded) {
  if (!loaded.baked) return "no grid: positions are the scene's floats";
  const FileSummary file = summarize(*loaded.baked);
  if (file.grids.empty()) return "no grid: no geometry";
  const auto& finest = *std::ranges::min_element(file.grids, {}, [](const GridUse& use) { return use.grid.step(); });
  return fmt::format("grid step {:.4g}{}{}, measured position error {:.3g}; as chosen by bake",
                     file.grids.front().grid.step(), file.grids.front().world_space ? " (world)" : "",
                     file.grids.size() > 1
                         ? fmt::format(" and {} more, the finest {:.4g}", file.grids.size() - 1, finest.grid.step())
                         : std::string(),
                     file.max_position_error);
}

} // namespace

double mean_of_valid(const std::vector<float>& ao) {
  double sum = 0;
  uint64_t count = 0;
  for (const float value : ao)
    if (value >= 0) sum += static_cast<double>(value), ++count;
  return count ? sum / static_cast<double>(count) : 0;
}

nlohmann::json render_json(const RenderOptions& options, const StillConfig& config, const RenderedImage& image,
                           const PictureReport& report, const FrameLoop& loop, const ChosenCamera& camera,
                           const std::vector<std::string>& files, const FileTimings& timings) {
  const std::vector<const RayTracer*> tracers = loop.tracers();
  const RayTracer& tracer = *tracers.back();
  const auto hits =
      std::count_if(image.instance.begin(), image.instance.end(), [](uint32_t i) { return i != kNoInstance; });
  const PassTimes& t = report.times;
  const nlohmann::json parts = resident_parts(tracers);
  nlohmann::json result = {
      {"verb", "render"},
      {"input", options.input},
      {"backend", tracer.name()},
      {"isa", tracer.isa()},
      {"files", files},
      {"camera",
       {{"index", camera.index ? nlohmann::json(*camera.index) : nlohmann::json()},
        {"frames_scene", !camera.index},
        {"reason", camera.reason.empty() ? nlohmann::json() : nlohmann::json(camera.reason)}}},
      {"width", image.size.width},
      {"height", image.size.height},
      {"supersample", config.supersample},
      {"frames", config.frames},
      {"spp", config.ao.spp},
      {"ao_resolution", options.ao.resolution},
      {"ao_rate", options.ao.rate},
      {"ao_sampler", options.ao.sampler},
      {"denoise", config.denoise},
      {"denoiser", denoiser_json(config.denoise, config.denoiser)},
      {"jitter", config.jitters() && config.frames > 1},
      {"ao_radius", config.ao.radius},
      {"ao_falloff", config.ao.falloff},
      {"seed", config.ao.seed},
      {"hit_pixels", hits},
      {"mean_ao", mean_of_valid(image.ao)},
      {"rays", {{"primary", report.primary_rays}, {"ao", report.ao_rays}}},
      {"mrays_per_s", {{"primary", rate_m(report.primary_rays, t.primary_s)}, {"ao", rate_m(report.ao_rays, t.ao_s)}}},
      {"seconds",
       {{"bvh", t.build_s},
        {"primary", t.primary_s},
        {"ao", t.ao_s},
        {"denoise", t.denoise_s},
        {"upsample", t.upsample_s},
        {"resolve", t.resolve_s}}},
      {"resident_bytes",
       {{"source", loop.traced_source().resident_bytes()},
        {"tracing", sum_of(parts)},
        {"bvh", parts.value("bvh", uint64_t{0})},
        {"parts", parts}}},
      {"peak_rss_bytes", peak_rss_bytes()},
  };
  result["seconds"]["load"] = timings.load_s;
  result["seconds"]["write"] = timings.write_s;
  add_shade_json(options.shade, report, loop, result);
  if (loop.detail() != nullptr) result["lod"] = detail_json(*loop.detail(), tracer);
  return result;
}

void print_render(std::FILE* stream, const nlohmann::json& r) {
  const auto& seconds = r.at("seconds");
  const auto frames = r.at("frames").get<double>();
  fmt::print(stream, "{}x{} pixels, {} frame{} of {} spp, mean ao {:.4f}\n", r.at("width").get<int>(),
             r.at("height").get<int>(), r.at("frames").get<int>(), frames == 1 ? "" : "s", r.at("spp").get<int>(),
             r.at("mean_ao").get<double>());
  fmt::print(stream, "  bvh       {:8.3f} s   {}, {}; {} resident\n", seconds.at("bvh").get<double>(),
             r.at("backend").get<std::string>(), r.at("isa").get<std::string>(), resident_text(r.at("resident_bytes")));
  fmt::print(stream, "  primary   {:8.3f} s   {:.1f} Mrays/s\n", seconds.at("primary").get<double>(),
             r.at("mrays_per_s").at("primary").get<double>());
  fmt::print(stream, "  ao        {:8.3f} s   {:.1f} Mrays/s\n", seconds.at("ao").get<double>(),
             r.at("mrays_per_s").at("ao").get<double>());
  fmt::print(stream, "{}", shade_text(r));
  if (r.at("denoise").get<bool>())
    fmt::print(stream, "  denoise   {:8.3f} s   {:.1f} ms per frame\n", seconds.at("denoise").get<double>(),
               seconds.at("denoise").get<double>() * 1e3 / frames);
  if (r.at("ao_resolution") == "quarter")
    fmt::print(stream, "  upsample  {:8.3f} s   occlusion of one of 2 x 2 pixels\n",
               seconds.at("upsample").get<double>());
  if (r.contains("lod")) fmt::print(stream, "{}", detail_text(r.at("lod")));
  if (r.contains("seams")) fmt::print(stream, "{}", visible_seams_text(r.at("seams")));
  if (const auto& reason = r.at("camera").at("reason"); !reason.is_null())
    fmt::print(stream, "{}: the image shows the whole scene\n", reason.get<std::string>());
  for (const auto& file : r.at("files")) print_printable("wrote " + file.get<std::string>() + "\n", stream);
}

std::string choices_text(const RenderOptions& options, const GlobalOptions& globals, const ChosenCamera& camera,
                         const StillConfig& config, const LoadedScene& loaded, const RayTracer& tracer,
                         const FileTimings& timings) {
  const Reasons reasons = reasons_of(*loaded.source, camera, options, config, loaded.baked.has_value(), globals);
  std::string text;
  const auto line = [&](const char* name, const std::string& what, const std::string& reason) {
    text += fmt::format("  {:<10}{}{}\n", name, what, reason.empty() ? "" : ": " + reason);
  };
  const char* const isa = std::getenv("PACKTRACE_ISA");
  line("camera", camera_text(camera.camera), reasons.camera);
  line("size",
       fmt::format("{}x{}, traced at {}x{}", config.size.width, config.size.height,
                   config.size.width * config.supersample, config.size.height * config.supersample),
       reasons.size);
  line("radius", fmt::format("ambient occlusion radius {:.5g}", config.ao.radius), reasons.radius);
  line("backend", fmt::format("backend {}, kernels {}", tracer.name(), tracer.isa()),
       reasons.backend + (isa && *isa ? std::string("; PACKTRACE_ISA is ") + isa : ""));
  line("grid", grid_text(loaded), {});
  line("threads",
       fmt::format("{} threads", tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)),
       reasons.threads);
  line("load", fmt::format("{:6.3f} s", timings.load_s), {});
  line("write", fmt::format("{:6.3f} s", timings.write_s), {});
  line("memory",
       fmt::format("peak memory {:.1f} MiB, of which the scene {:.1f} MiB",
                   static_cast<double>(peak_rss_bytes()) / (1 << 20),
                   static_cast<double>(loaded.source->resident_bytes()) / (1 << 20)),
       {});
  return text;
}

} // namespace packtrace
