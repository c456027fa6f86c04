#include "runtime/commands/render_choices.h"

#include <algorithm>
#include <cstdlib>

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "compress/format/file/file_summary.h"
#include "runtime/commands/file_report.h"
#include "runtime/commands/process_usage.h"

namespace packtrace {
namespace {

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

std::string choices_text(const RenderChoices& choices, const RenderConfig& config, const LoadedScene& loaded,
                         const RayTracer& tracer, const FileTimings& timings) {
  std::string text;
  const auto line = [&](const char* name, const std::string& what, const std::string& reason) {
    text += fmt::format("  {:<10}{}{}\n", name, what, reason.empty() ? "" : ": " + reason);
  };
  const char* const isa = std::getenv("PACKTRACE_ISA");
  line("camera", camera_text(choices.camera), choices.camera_reason);
  line("size",
       fmt::format("{}x{}, traced at {}x{}", config.size.width, config.size.height,
                   config.size.width * config.supersample, config.size.height * config.supersample),
       choices.size_reason);
  line("radius", fmt::format("ambient occlusion radius {:.5g}", config.ao.radius), choices.radius_reason);
  line("backend", fmt::format("backend {}, kernels {}", tracer.name(), tracer.isa()),
       choices.backend_reason + (isa && *isa ? std::string("; PACKTRACE_ISA is ") + isa : ""));
  line("grid", grid_text(loaded), {});
  line("threads",
       fmt::format("{} threads", tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)),
       choices.threads_reason);
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
