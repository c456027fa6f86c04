#include "tests/benchmarks/trace_benchmark_systems.h"

#include <cstdio>
#include <utility>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/stopwatch.h"
#include "runtime/trace/make_tracer.h"
#include "tests/benchmarks/trace_benchmark_exact.h"
#include "tests/runtime/trace/embree_cluster_tracer.h"

namespace packtrace {
namespace {

using Json = nlohmann::ordered_json;

template <typename Make>
void add_tracer(const char* name, const Make& make, Systems& out) {
  try {
    const Stopwatch watch;
    std::unique_ptr<RayTracer> tracer = make();
    out.rows.push_back({name, kRayTracer, std::move(tracer), 1e3 * watch.seconds(), true});
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kUnsupported) throw;
    fmt::print(stderr, "{}: {}\n", name, error.what());
  }
}

/// Nearest hits of any-hit rays, reported by one system.
std::vector<RayHit> nearest_hits(const RecordedRays& rays, const RayTracer& tracer) {
  RecordedRays closest = rays;
  closest.any = false;
  RayResults results;
  replay(closest, tracer, results, false);
  return std::move(results.hits);
}

/// Judges all rows, per phase.
std::vector<std::vector<HitVerdicts>> judge_phases(const TraceInput& input, const Systems& systems) {
  const System& truth = systems.rows[systems.truth];
  const ExactTriangles triangles(input.file, truth.tracer->space());
  std::vector<std::vector<HitVerdicts>> verdicts;
  for (size_t phase = 0; phase < truth.rays->size(); ++phase) {
    const RecordedRays& rays = (*truth.rays)[phase];
    std::vector<SystemHits> all;
    std::vector<std::vector<RayHit>> nearest; // these hits only add candidates; `all` refers to them
    nearest.reserve(systems.rows.size());
    for (const System& row : systems.rows)
      all.push_back({row.tracer.get(), row.results[phase].hits, row.results[phase].occluded,
                     truth.tracer->space().scale() / row.tracer->space().scale()});
    if (rays.any)
      for (const System& row : systems.rows)
        if (&row == &truth || row.call == kRayTracer) {
          nearest.push_back(nearest_hits((*row.rays)[phase], *row.tracer));
          all.push_back({row.tracer.get(), nearest.back(), {}, 1.0});
        }
    verdicts.push_back(judge(rays.rays, triangles, all));
    verdicts.back().resize(systems.rows.size());
  }
  return verdicts;
}

} // namespace

Systems make_systems(const TraceInput& input, const char* embree_device) {
  struct Variant {
    const char* name;
    EmbreeConfig config;
  };
  struct Call {
    const char* name;
    EmbreeCall call;
  };
  const auto config = [&](BvhQuality quality, bool robust, bool compact) {
    return EmbreeConfig{quality, robust, compact, false, std::nullopt, embree_device};
  };
  Systems out;
  for (const Variant& variant : {Variant{"Embree default", config(BvhQuality::kMedium, false, false)},
                                 Variant{"Embree robust", config(BvhQuality::kMedium, true, false)},
                                 Variant{"Embree high", config(BvhQuality::kHigh, false, false)},
                                 Variant{"Embree compact", config(BvhQuality::kMedium, false, true)}}) {
    const Stopwatch watch;
    out.trees.push_back(std::make_unique<EmbreeTracer>(input.source, variant.config));
    const double build_ms = 1e3 * watch.seconds();
    for (const Call& call :
         {Call{"1", EmbreeCall::kSingle}, Call{"16", EmbreeCall::kPacket16}, Call{"1M", EmbreeCall::kStream}})
      out.rows.push_back(
          {variant.name, call.name, direct_embree(*out.trees.back(), call.call), build_ms, variant.config.robust});
  }
  out.single = 0, out.packets = 1, out.truth = 3, out.truth_trees = 1;
  add_tracer("embree", [&] { return make_tracer(input.source, &input.file, {}); }, out);
  add_tracer("packed", [&] { return make_tracer(input.source, &input.file, {Backend::kPacked, {}}); }, out);
  for (const ClusterPrimitives primitives : {ClusterPrimitives::kClusters, ClusterPrimitives::kLeafNodes}) {
    const bool clusters = primitives == ClusterPrimitives::kClusters;
    const auto make = [&] {
      return std::make_unique<EmbreeClusterTracer>(input.file, input.source, chosen_isa(), primitives);
    };
    add_tracer(clusters ? "embree-clusters" : "embree-clusters, nodes", make, out);
  }
  return out;
}

Json compare_with_exact_hits(const TraceInput& input, const Systems& systems) {
  const std::vector<std::vector<HitVerdicts>> verdicts = judge_phases(input, systems);
  fmt::print(
      "\nagainst exact hits: missed / wrong / farther / beside / t off; largest error of t, relative, and in ulp off "
      "the plane\n\n| system | call | primary | ao any | ao closest | primary | ao closest |\n"
      "|---|---|---|---|---|---|---|\n");
  Json json = Json::array();
  for (size_t s = 0; s < systems.rows.size(); ++s) {
    const System& row = systems.rows[s];
    Json out{{"system", row.name}, {"call", row.call}};
    std::string counts, errors;
    for (size_t phase = 0; phase < verdicts.size(); ++phase) {
      const HitVerdicts& v = verdicts[phase][s];
      const RecordedRays& rays = (*row.rays)[phase];
      Json of_phase{{"phase", rays.name}, {"missed", v.missed}, {"wrong", v.wrong}};
      counts += fmt::format(" {} / {}", v.missed, v.wrong);
      if (!rays.any) {
        of_phase.update(Json{{"farther", v.farther},
                             {"beside", v.beside},
                             {"t_off", v.t_off},
                             {"worst_relative_t", v.worst_t},
                             {"worst_ulps_off_plane", v.worst_ulps}});
        counts += fmt::format(" / {} / {} / {}", v.farther, v.beside, v.t_off);
        errors += fmt::format(" {:.2g}, {:.1f} |", v.worst_t, v.worst_ulps);
      }
      counts += " |";
      out["phases"].push_back(std::move(of_phase));
    }
    fmt::print("| {} | {} |{}{}\n", row.name, row.call, counts, errors);
    json.push_back(std::move(out));
  }
  std::fflush(stdout);
  return json;
}

} // namespace packtrace
