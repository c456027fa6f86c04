#include "runtime/view/profile.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

/// The value that a fraction of the rows does not exceed.
template <typename Value>
double percentile(const std::vector<ProfileRow>& rows, double fraction, const Value& value) {
  std::vector<double> sorted;
  for (const ProfileRow& row : rows) sorted.push_back(value(row));
  std::ranges::sort(sorted);
  const double rank = std::ceil(fraction * static_cast<double>(sorted.size())) - 1.0;
  return sorted[static_cast<size_t>(std::max(0.0, rank))];
}

template <typename Value>
nlohmann::json spread_json(const std::vector<ProfileRow>& rows, const Value& value) {
  return {{"median_ms", percentile(rows, 0.5, value)},
          {"p99_ms", percentile(rows, 0.99, value)},
          {"max_ms", percentile(rows, 1.0, value)}};
}

} // namespace

std::vector<ProfileRow> profile_orbit(ViewSession& session, uint32_t frames, Progress& progress) {
  std::vector<ProfileRow> rows;
  for (uint32_t i = 0; i < frames; ++i) {
    session.move_camera([&](ViewCamera& camera) { camera.turn(360.0 / frames, 0.0); });
    const Stopwatch watch;
    if (!session.step(progress)) throw Error(ErrorKind::kCancelled, "cancelled");
    session.picture();
    const double ms = 1e3 * watch.seconds();
    session.add_frame_time(ms);
    rows.push_back({session.last(), ms});
  }
  return rows;
}

std::string profile_csv(const std::vector<ProfileRow>& rows) {
  std::string text = "frame,total_ms";
  for (const auto& [name, member] : kPasses) text.append(",").append(name).append("_ms");
  text += ",primary_rays,ao_rays,mean_history,traced_width,traced_height,quality_step\n";
  for (size_t i = 0; i < rows.size(); ++i) {
    const ViewFrame& f = rows[i].frame;
    text += fmt::format("{},{:.3f}", i, rows[i].total_ms);
    for (const auto& [name, member] : kPasses) text += fmt::format(",{:.3f}", 1e3 * (f.report.times.*member));
    text += fmt::format(",{},{},{:.2f},{},{},{}\n", f.report.primary_rays, f.report.ao_rays, f.report.mean_history,
                        f.traced.width, f.traced.height, f.quality_step);
  }
  return text;
}

nlohmann::json profile_json(const std::vector<ProfileRow>& rows) {
  nlohmann::json json = {{"frames", rows.size()}};
  if (rows.empty()) return json;
  json["total"] = spread_json(rows, [](const ProfileRow& row) { return row.total_ms; });
  for (const auto& [name, member] : kPasses)
    json["passes"][name] =
        spread_json(rows, [m = member](const ProfileRow& row) { return 1e3 * (row.frame.report.times.*m); });
  uint64_t primary = 0, ao = 0;
  for (const ProfileRow& row : rows) {
    const ViewFrame& f = row.frame;
    primary += f.report.primary_rays, ao += f.report.ao_rays;
    nlohmann::json item = {{"total_ms", row.total_ms},
                           {"rays", {{"primary", f.report.primary_rays}, {"ao", f.report.ao_rays}}},
                           {"history", f.report.mean_history},
                           {"traced", {f.traced.width, f.traced.height}},
                           {"quality_step", f.quality_step}};
    json["list"].push_back(std::move(item));
  }
  json["rays"] = {{"primary", primary}, {"ao", ao}};
  return json;
}

} // namespace packtrace
