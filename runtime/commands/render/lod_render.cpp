#include "runtime/commands/render/lod_render.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/reports/file_report.h"
#include "runtime/lod/compaction.h"
#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {
namespace {

constexpr std::array<std::pair<const char*, SharingScheme>, 3> kSchemes{
    {{"steps", SharingScheme::kSteps}, {"one-provider", SharingScheme::kOneProvider}, {"off", SharingScheme::kOff}}};

/// @param name a name in kSchemes, which the option's check guarantees
SharingScheme scheme_of(const std::string& name) {
  return std::ranges::find(kSchemes, name, &std::pair<const char*, SharingScheme>::first)->second;
}

const char* name_of(SharingScheme scheme) {
  return std::ranges::find(kSchemes, scheme, &std::pair<const char*, SharingScheme>::second)->first;
}

/// Simulates BLAS compaction (BlasCompactor) for the built trees. The result is the memory that a GPU would hold, which
/// must allocate the worst case before each build.
class TreeMemory final : public BlasMemoryBackend {
public:
  /// @param base_of maps TreeBytes::geometry to the file's geometry
  template <typename BaseOf>
  TreeMemory(const std::vector<TreeBytes>& trees, const BaseOf& base_of) : trees_(trees) {
    CompactionConfig config;
    BlasCompactor compactor(*this, config);
    std::vector<uint32_t> moving;
    for (uint32_t i = 0; i < trees.size(); ++i) {
      worst_case += trees[i].worst_case;
      if (trees[i].built == 0) continue;
      compactor.add(i, base_of(trees[i].geometry));
      moving.push_back(i);
    }
    while (!moving.empty()) { // every frame advances the state of some trees
      compactor.begin_frame();
      std::erase_if(moving, [&](uint32_t i) { return compactor.state_of(i) == BlasMemoryState::kSettled; });
    }
    for (uint32_t frame = 0; frame < config.frames_in_flight; ++frame) compactor.begin_frame(); // releases old buffers
    resident = compactor.resident_bytes();
    peak = compactor.peak_bytes();
    by_geometry = compactor.geometry_bytes();
  }

  BlasBuffer allocate(uint64_t) override { return ++next_; }
  void release(BlasBuffer) override {}
  uint64_t worst_case_bytes(uint32_t blas) override { return trees_[blas].worst_case; }
  void record_build(uint32_t, BlasBuffer) override {}
  uint64_t compacted_bytes(uint32_t blas) override { return trees_[blas].built; }
  void record_copy(uint32_t, BlasBuffer, BlasBuffer) override {}

  uint64_t worst_case = 0, resident = 0, peak = 0;
  std::map<uint32_t, GeometryBytes> by_geometry; ///< keyed by the file's geometry; kNoGeometry: the TLAS

private:
  const std::vector<TreeBytes>& trees_;
  BlasBuffer next_ = 0;
};

/// A row per geometry that has LOD levels and instances.
nlohmann::json geometries_json(const DetailPlanner& detail) {
  nlohmann::json rows = nlohmann::json::array();
  std::vector<uint64_t> instances(detail.geometries().size(), 0), builds = instances, triangles = instances;
  for (const LodInstance& instance : detail.instances()) ++instances[instance.geometry];
  for (const PlannedBlas& blas : detail.current().blas) {
    if (blas.kind == BlasKind::kCoarsest) continue;
    ++builds[blas.geometry];
    triangles[blas.geometry] += blas.triangles;
  }
  for (size_t g = 0; g < detail.geometries().size(); ++g) {
    const size_t levels = detail.geometries()[g].levels().size();
    if (levels < 2 || instances[g] == 0) continue;
    nlohmann::json row = {{"geometry", g},
                          {"levels", levels},
                          {"instances", instances[g]},
                          {"builds", builds[g]},
                          {"built_triangles", triangles[g]}};
    if (detail.sharing().config().measure) {
      const LevelHistogram& histogram = detail.current().histograms[g];
      const auto counts = [&](const auto& by_level) {
        return std::vector<uint32_t>(by_level.begin(), by_level.begin() + static_cast<std::ptrdiff_t>(levels));
      };
      row["first_level"] = counts(histogram.starts);
      row["last_level"] = counts(histogram.ends);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

nlohmann::json trees_json(const DetailPlanner& detail, const RayTracer& tracer) {
  const std::vector<TreeBytes> trees = tracer.tree_bytes();
  const TreeMemory memory(
      trees, [&](uint32_t blas) { return blas == kNoGeometry ? kNoGeometry : detail.source().base_geometry(blas); });
  nlohmann::json rows = nlohmann::json::array();
  for (const auto& [geometry, bytes] : memory.by_geometry)
    rows.push_back({{"geometry", geometry == kNoGeometry ? nlohmann::json() : nlohmann::json(geometry)},
                    {"worst_case_bytes", bytes.worst_case},
                    {"resident_bytes", bytes.now}});
  return {{"count", trees.size()},
          {"worst_case_bytes", memory.worst_case},
          {"resident_bytes", memory.resident},
          {"peak_bytes", memory.peak},
          {"geometries", rows}};
}

double ratio(double a, double b) { return b > 0.0 ? a / b : 0.0; }

} // namespace

void add_lod_options(CLI::App& verb, LodOptions& options) {
  std::vector<std::string> schemes;
  for (const auto& [name, scheme] : kSchemes) schemes.emplace_back(name);
  constexpr const char* kGroup = "Levels of detail (for files baked with --lod)";
  verb.add_option("--lod-error", options.error_px,
                  "Maximum screen-space error in pixels; coarser LOD levels are used where their error is smaller "
                  "(default: level 0 everywhere). Pixels are those traced, so --supersample 2 halves the error. Start "
                  "with 1; 0.2 also keeps seams between instances below half a pixel")
      ->type_name("PX")
      ->group(kGroup);
  verb.add_option("--lod-scheme", options.scheme,
                  "How instances share acceleration structures (BLASes). steps shares BLASes that do not depend on "
                  "the view; with one-provider, one instance of each geometry shares its own cut; off uses level 0 "
                  "for all (default steps)")
      ->check(one_of(schemes))
      ->group(kGroup);
  verb.add_option("--lod-traced-ratio", options.traced_ratio,
                  "Maximum number of traced triangles for steps, relative to a separate cut per instance, "
                  "1 or more (default 1.25). Larger values build fewer BLASes; 0 decides for each instance separately")
      ->type_name("R")
      ->group(kGroup);
  verb.add_option("--lod-tolerance", options.tolerance,
                  "Number of levels (or steps) by which a shared BLAS may be too coarse, 0..32 (default 0). Above 0, "
                  "fewer BLASes are built, but the error may exceed --lod-error")
      ->type_name("N")
      ->group(kGroup);
  verb.add_option("--lod-culled-scale", options.culled_scale,
                  "Factor on --lod-error for instances that --lod-cull selects, 1..1e6 (default 1)")
      ->type_name("S")
      ->group(kGroup);
  verb.add_option("--lod-cull", options.cull,
                  "Instances to which --lod-culled-scale applies. frustum selects those outside the camera's view; "
                  "visible selects those that no pixel shows, and needs --lod-rays occlusion (default frustum)")
      ->check(one_of({"frustum", "visible"}))
      ->group(kGroup);
  verb.add_option("--lod-rays", options.rays,
                  "Rays that use coarser levels. all means camera and occlusion rays; with occlusion, camera rays use "
                  "level 0, so that thin and touching parts look as without LOD (default all)")
      ->check(one_of({"all", "occlusion"}))
      ->group(kGroup);
}

DetailConfig detail_config(const LodOptions& options, bool measure) {
  if (!options.error_px && (options.scheme || options.traced_ratio || options.culled_scale || options.tolerance ||
                            options.rays || options.cull))
    throw Error(ErrorKind::kUsage, "the other --lod options require --lod-error");
  DetailConfig config;
  config.error_px = options.error_px;
  config.only_occlusion = options.rays == "occlusion";
  config.cull_invisible = options.cull == "visible";
  SharingConfig& sharing = config.sharing;
  if (options.scheme) sharing.scheme = scheme_of(*options.scheme);
  if (options.traced_ratio) sharing.traced_ratio = *options.traced_ratio;
  if (options.culled_scale) sharing.culled_error_scale = *options.culled_scale;
  if (options.tolerance) sharing.tolerant_levels = *options.tolerance;
  sharing.measure = measure;
  config.validate();
  return config;
}

void require_levels(const std::string& input, const LoadedScene& loaded) {
  if (!loaded.baked)
    throw Error(ErrorKind::kUsage, input + ": --lod-error requires a .ptk file; bake the scene with --lod");
  if (loaded.baked->sections().lod_levels.empty())
    throw Error(
        ErrorKind::kUsage,
        input + ": --lod-error: the file has no levels of detail; bake it with --lod, which says if none can be made");
}

nlohmann::json detail_json(const DetailPlanner& detail, const RayTracer& tracer) {
  const LodPlan& plan = detail.current();
  const auto& counts = plan.category_counts;
  nlohmann::json result = {
      {"scheme", name_of(detail.sharing().config().scheme)},
      {"error_px", detail.error_px()},
      {"instances", detail.instances().size()},
      {"instances_culled", detail.culled()},
      {"builds", plan.builds},
      {"built_triangles", plan.built_triangles},
      {"built_clusters", plan.built_clusters},
      {"traced_triangles", plan.traced_triangles},
      {"categories", {{"lowest", counts[0]}, {"provider", counts[1]}, {"shares", counts[2]}, {"own", counts[3]}}},
      {"seconds", {{"load", detail.load_s()}, {"plan", detail.plan_s()}, {"clusters", detail.source_s()}}},
      {"geometries", geometries_json(detail)},
  };
  if (detail.sharing().config().measure) {
    result["references_saved"] = static_cast<int64_t>(plan.own.builds) - static_cast<int64_t>(plan.builds);
    result["own_cuts"] = {{"builds", plan.own.builds},
                          {"built_triangles", plan.own.built_triangles},
                          {"traced_triangles", plan.own.traced_triangles}};
    result["traced_ratio"] =
        ratio(static_cast<double>(plan.traced_triangles), static_cast<double>(plan.own.traced_triangles));
  }
  result["trees"] = trees_json(detail, tracer);
  if (const auto* packed = dynamic_cast<const PackedTracer*>(&tracer)) {
    result["seconds"]["cluster_nodes"] = packed->lod_trees().clusters_s;
    result["seconds"]["trees"] = packed->lod_trees().trees_s;
  }
  return result;
}

std::string detail_text(const nlohmann::json& r) {
  const auto count = [](const nlohmann::json& value) { return value.get<uint64_t>(); };
  const auto ms = [&](const char* name) { return 1e3 * r.at("seconds").at(name).get<double>(); };
  const auto& categories = r.at("categories");
  const uint64_t builds = count(r.at("builds"));
  std::string text =
      fmt::format(grouped(), "  lod       {} px, {}: {:L} BLASes for {:L} instances", r.at("error_px").get<double>(),
                  r.at("scheme").get<std::string>(), builds, count(r.at("instances")));
  const bool measured = r.contains("own_cuts");
  if (measured) {
    const uint64_t alone = count(r.at("own_cuts").at("builds"));
    text +=
        fmt::format(grouped(), " ({:+.1f} % vs. {:L} without sharing)",
                    alone > 0 ? 100.0 * (static_cast<double>(builds) / static_cast<double>(alone) - 1.0) : 0.0, alone);
  }
  text += fmt::format(grouped(), "\n            {:L} triangles built, {:L} traced", count(r.at("built_triangles")),
                      count(r.at("traced_triangles")));
  if (measured) text += fmt::format(" ({:.3f} times those of separate cuts)", r.at("traced_ratio").get<double>());
  text += "\n";
  text +=
      fmt::format(grouped(),
                  "            instances: {:L} use the coarsest cut, {:L} the first of a shared BLAS, {:L} more share "
                  "it, {:L} have their own; {:L} culled\n",
                  count(categories.at("lowest")), count(categories.at("provider")), count(categories.at("shares")),
                  count(categories.at("own")), count(r.at("instances_culled")));
  text += fmt::format("            planning {:.1f} ms, cluster lists {:.1f} ms", ms("plan"), ms("clusters"));
  if (r.at("seconds").contains("trees")) text += fmt::format(", upper BVH nodes {:.1f} ms", ms("trees"));
  const auto& trees = r.at("trees");
  return text + fmt::format(grouped(), "; {:L} trees, {:L} bytes (worst case {:L})\n", count(trees.at("count")),
                            count(trees.at("resident_bytes")), count(trees.at("worst_case_bytes")));
}

} // namespace packtrace
