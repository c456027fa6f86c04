#include "runtime/view/file_contents.h"

#include <algorithm>

#include <fmt/format.h>

namespace packtrace {
namespace {

constexpr size_t kMaxGeometries = 8;

/// Adds the parts of a tracer; shared ones count once.
void add_resident(const RayTracer& tracer, bool first, FileContents::Rows& rows) {
  for (const ResidentPart& part : tracer.resident()) {
    if (part.bytes == 0 || (part.shared && !first)) continue;
    const auto same = std::ranges::find(rows, std::string(part.name), &FileContents::Rows::value_type::first);
    if (same != rows.end())
      same->second += part.bytes;
    else
      rows.emplace_back(part.name, part.bytes);
  }
}

std::string millions(uint64_t triangles) { return fmt::format("{:.3g} M", 1e-6 * static_cast<double>(triangles)); }

std::vector<std::string> plan_lines(const DetailPlanner& detail) {
  const LodPlan& plan = detail.current();
  const auto& counts = plan.category_counts;
  std::vector<std::string> lines{
      fmt::format("error at most {:g} px, {} instances", detail.error_px(), detail.instances().size()),
      fmt::format("{} the coarsest, {} own cuts", counts[static_cast<size_t>(InstanceCategory::kCoarsest)],
                  counts[static_cast<size_t>(InstanceCategory::kOwn)]),
      fmt::format("{} a step, {} of them shared",
                  counts[static_cast<size_t>(InstanceCategory::kProvider)] +
                      counts[static_cast<size_t>(InstanceCategory::kShares)],
                  counts[static_cast<size_t>(InstanceCategory::kShares)]),
      fmt::format("{} trees, {} triangles built", plan.builds, millions(plan.built_triangles)),
      millions(plan.traced_triangles) + " triangles over all instances"};
  if (detail.culled() > 0) lines.push_back(fmt::format("{} instances culled", detail.culled()));
  return lines;
}

FileContents::Rows traced_rows(const ViewFile& file, const LodPlan& plan) {
  const std::vector<std::string> names = file.geometry_names ? file.geometry_names() : std::vector<std::string>();
  std::vector<uint64_t> triangles;
  for (const PlannedBlas& blas : plan.blas) {
    triangles.resize(std::max<size_t>(triangles.size(), blas.geometry + 1));
    triangles[blas.geometry] += blas.triangles;
  }
  FileContents::Rows rows;
  for (size_t g = 0; g < triangles.size(); ++g)
    if (triangles[g] > 0) rows.emplace_back(g < names.size() ? names[g] : fmt::format("geometry {}", g), triangles[g]);
  std::ranges::stable_sort(rows, std::greater<>(), &FileContents::Rows::value_type::second);
  if (rows.size() > kMaxGeometries) rows.resize(kMaxGeometries);
  return rows;
}

} // namespace

FileContents file_contents(const ViewFile& file, const PaneRenderer& pane) {
  FileContents contents;
  if (file.stream_bytes) contents.streams = file.stream_bytes();
  for (const RayTracer* tracer : pane.loop().tracers()) {
    if (tracer == nullptr) continue;
    add_resident(*tracer, contents.resident.empty(), contents.resident);
  }
  if (const DetailPlanner* const detail = pane.loop().detail()) {
    contents.plan = plan_lines(*detail);
    contents.traced = traced_rows(file, detail->current());
  }
  return contents;
}

} // namespace packtrace
