#include "runtime/commands/sequence/sequence_report.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace packtrace {
namespace {

/// Value of a sorted list at a fraction of its length, rounded up.
double at_fraction(const std::vector<double>& sorted, double fraction) {
  const double rank = fraction * static_cast<double>(sorted.size());
  const size_t index = static_cast<size_t>(std::max(0.0, std::ceil(rank) - 1.0));
  return sorted[std::min(index, sorted.size() - 1)];
}

template <typename Value>
nlohmann::json distribution_json(const std::vector<PictureRow>& rows, const Value& value) {
  std::vector<double> sorted;
  for (const PictureRow& row : rows) sorted.push_back(value(row));
  std::ranges::sort(sorted);
  return {{"median", at_fraction(sorted, 0.5)}, {"p99", at_fraction(sorted, 0.99)}, {"max", sorted.back()}};
}

nlohmann::json row_json(const PictureRow& row) {
  nlohmann::json result = {{"picture", row.picture}, {"time", row.time_s},          {"seconds", row.total_s()},
                           {"write_s", row.write_s}, {"history", row.mean_history}, {"rebuilt", row.rebuilt}};
  for (const auto& [name, member] : kPasses) result["passes"][name] = row.times.*member;
  result["rays"] = {{"primary", row.primary_rays}, {"ao", row.ao_rays}};
  if (row.traced_triangles > 0) result["lod"] = {{"builds", row.builds}, {"traced_triangles", row.traced_triangles}};
  return result;
}

} // namespace

PictureRow::PictureRow(uint64_t number, double time, const PictureReport& report, const DetailPlanner* detail)
    : picture(number), time_s(time), times(report.times), primary_rays(report.primary_rays), ao_rays(report.ao_rays),
      mean_history(report.mean_history), builds(detail != nullptr ? detail->current().builds : 0),
      traced_triangles(detail != nullptr ? detail->current().traced_triangles : 0), rebuilt(report.rebuilt) {}

std::string csv_header() {
  std::string text = "picture,time_s,total_ms";
  for (const auto& [name, member] : kPasses) text.append(",").append(name).append("_ms");
  return text + ",write_ms,primary_rays,ao_rays,mean_history,lod_builds,lod_traced_triangles,lod_rebuilt\n";
}

std::string csv_line(const PictureRow& row) {
  std::string text = fmt::format("{},{:.6f},{:.3f}", row.picture, row.time_s, 1e3 * row.total_s());
  for (const auto& [name, member] : kPasses) text += fmt::format(",{:.3f}", 1e3 * (row.times.*member));
  return text + fmt::format(",{:.3f},{},{},{:.2f},{},{},{}\n", 1e3 * row.write_s, row.primary_rays, row.ao_rays,
                            row.mean_history, row.builds, row.traced_triangles, row.rebuilt ? 1 : 0);
}

nlohmann::json sequence_json(const Sequence& sequence, const std::vector<PictureRow>& rows) {
  nlohmann::json result = {{"pictures", sequence.pictures},
                           {"rendered", rows.size()},
                           {"fps", sequence.fps},
                           {"subframes", sequence.subframes},
                           {"start_time", sequence.start_s}};
  if (rows.empty()) return result;
  result["seconds"] = distribution_json(rows, [](const PictureRow& row) { return row.total_s(); });
  for (const auto& [name, member] : kPasses)
    result["passes"][name] = distribution_json(rows, [m = member](const PictureRow& row) { return row.times.*m; });
  result["history"] = distribution_json(rows, [](const PictureRow& row) { return row.mean_history; });
  if (rows.size() > kMaxListedPictures) return result;
  result["list"] = nlohmann::json::array();
  for (const PictureRow& row : rows) result["list"].push_back(row_json(row));
  return result;
}

std::string sequence_text(const nlohmann::json& r) {
  std::string text = fmt::format("{} pictures at {} per second, {} frames each", r.at("rendered").get<uint64_t>(),
                                 r.at("fps").get<double>(), r.at("subframes").get<uint32_t>());
  if (!r.contains("seconds")) return text + "\n";
  const auto ms = [](const nlohmann::json& values, const char* name) { return 1e3 * values.at(name).get<double>(); };
  text += fmt::format("\n  a picture {:8.1f} ms (median), {:.1f} ms (99 % take less)\n", ms(r.at("seconds"), "median"),
                      ms(r.at("seconds"), "p99"));
  for (const auto& [name, member] : kPasses)
    if (const auto& pass = r.at("passes").at(name); pass.at("max").get<double>() > 0.0)
      text += fmt::format("  {:<10}{:8.1f} ms, {:.1f} ms\n", name, ms(pass, "median"), ms(pass, "p99"));
  return text + fmt::format("  history   {:8.1f} frames\n", r.at("history").at("median").get<double>());
}

} // namespace packtrace
