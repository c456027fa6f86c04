#include "runtime/measure/report.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/measure/knobs.h"
#include "runtime/measure/pareto.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;

struct FrontKind {
  const char *name, *x, *y, *x_label, *y_label;
  bool larger_x_is_better;
};
constexpr std::array<FrontKind, 4> kFronts{{
    {"bytes-error", "bytes.file", "ao.mae", "file, bytes", "AO error (MAE)", false},
    {"bytes-distance", "bytes.file", "distance.to_source.rms", "file, bytes", "RMS distance, world units", false},
    {"speed-error", "mrays_per_s.ao", "ao.mae", "AO rays, millions per second", "AO error (MAE)", true},
    {"memory-error", "resident_bytes", "ao.mae", "resident while tracing, bytes", "AO error (MAE)", false},
}};

/// Value at a path; null if a part of it is missing.
Json value_at(const Json& object, const std::string& path) {
  const Json* at = &object;
  for (size_t start = 0; start <= path.size();) {
    const size_t end = std::min(path.find('.', start), path.size());
    const std::string name = path.substr(start, end - start);
    if (!at->is_object() || !at->contains(name)) return nullptr;
    at = &at->at(name);
    start = end + 1;
  }
  return *at;
}

double cost(const Json& point, const char* path, bool larger_is_better) {
  const std::optional<double> value = number_at(point, path);
  if (!value) return std::numeric_limits<double>::quiet_NaN();
  return larger_is_better ? 1.0 / *value : *value; // stays positive, so that its logarithm exists
}

std::string csv_field(const Json& value) {
  if (value.is_null()) return {};
  if (!value.is_string()) return value.dump();
  const auto text = value.get<std::string>();
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

constexpr std::array<std::pair<const char*, const char*>, 43> kColumns{{
    {"id", "id"},
    {"group", "group"},
    {"status", "status"},
    {"positions", ""}, // see positions_text()
    {"normals", "knobs.normals"},
    {"codec", "knobs.codec"},
    {"trees", "knobs.trees"},
    {"lod", "knobs.lod"},
    {"spp", "knobs.spp"},
    {"frames", "knobs.frames"},
    {"denoise", "knobs.denoise"},
    {"ao_resolution", "knobs.ao_resolution"},
    {"file_bytes", "bytes.file"},
    {"memory_bytes", "bytes.memory"},
    {"bytes_per_triangle", "bytes.per_triangle"},
    {"resident_bytes", "resident_bytes"},
    {"position_max", "position.max"},
    {"position_rms", "position.rms"},
    {"distance_to_packed_max", "distance.to_packed.max"},
    {"distance_to_source_max", "distance.to_source.max"},
    {"distance_rms", "distance.to_source.rms"},
    {"normal_max_degrees", "normal.max_degrees"},
    {"normal_mean_degrees", "normal.mean_degrees"},
    {"collapsed_triangles", "triangles.collapsed"},
    {"ao_mae", "ao.mae"},
    {"ao_rmse", "ao.rmse"},
    {"ao_p99", "ao.p99"},
    {"ao_psnr_db", "ao.psnr_db"},
    {"ao_ssim", "ao.ssim"},
    {"ao_flip", "ao.flip"},
    {"noise_ratio", "ao.noise_ratio"},
    {"bake_seconds", "seconds.bake"},
    {"open_seconds", "seconds.open"},
    {"first_ray_seconds", "seconds.first_ray"},
    {"camera_mrays_per_s", "mrays_per_s.camera"},
    {"ao_mrays_per_s", "mrays_per_s.ao"},
    {"camera_speed_ratio", "speed_ratio.camera"},
    {"ao_speed_ratio", "speed_ratio.ao"},
    {"bake_peak_bytes", "peak_bytes.bake"},
    {"render_peak_bytes", "peak_bytes.render"},
    {"dominated", "flags.dominated"},
    {"bake_command", "commands.bake"},
    {"render_command", "commands.render"},
}};

Json positions_text(const Json& point) {
  auto text = value_at(point, "knobs.positions.kind").get<std::string>();
  if (const std::optional<double> value = number_at(point, "knobs.positions.value")) text += " " + number_text(*value);
  return text;
}

} // namespace

std::optional<double> number_at(const nlohmann::json& object, const std::string& path) {
  const Json value = value_at(object, path);
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

bool on_equal_terms(const nlohmann::json& point, uint32_t spp) {
  const Json& knobs = point.at("knobs");
  return point.at("status") == "ok" && knobs.at("spp") == spp && knobs.at("frames") == 1 &&
         knobs.at("denoise") == false && knobs.at("lod_error_px").is_null() && knobs.at("backend") == "packed" &&
         knobs.at("ao_resolution") == "full";
}

nlohmann::json add_fronts(nlohmann::json& points, uint32_t spp) {
  std::vector<Json*> equal;
  for (Json& point : points) {
    const bool eligible = on_equal_terms(point, spp);
    point["flags"] = {{"default", point.at("group") == "default"},
                      {"dominated", eligible ? Json(true) : Json()},
                      {"knee", false},
                      {"fronts", Json::array()}};
    if (eligible) equal.push_back(&point);
  }
  Json fronts = Json::array();
  for (const FrontKind& kind : kFronts) {
    std::vector<Costs> costs;
    for (const Json* point : equal)
      costs.push_back({cost(*point, kind.x, kind.larger_x_is_better), cost(*point, kind.y, false)});
    const std::vector<size_t> front = pareto_front(costs);
    const std::optional<size_t> knee = knee_of(costs, front);
    const bool main = kind.name == std::string_view("bytes-error");
    Json ids = Json::array();
    for (const size_t i : front) {
      ids.push_back(equal[i]->at("id"));
      (*equal[i])["flags"]["fronts"].push_back(kind.name);
      if (main) (*equal[i])["flags"]["dominated"] = false;
    }
    if (knee && main) (*equal[*knee])["flags"]["knee"] = true;
    fronts.push_back({{"name", kind.name},
                      {"x", kind.x},
                      {"y", kind.y},
                      {"x_label", kind.x_label},
                      {"y_label", kind.y_label},
                      {"ids", ids},
                      {"knee_id", knee ? equal[*knee]->at("id") : Json()}});
  }
  return fronts;
}

nlohmann::json lod_curve(const nlohmann::json& points) {
  Json curve = Json::array();
  double finest = 0.0;
  for (const Json& point : points) {
    const Json& knobs = point.at("knobs");
    if (point.at("status") != "ok" || knobs.at("lod") != "all") continue;
    const std::optional<double> triangles = number_at(point, "traced_triangles");
    if (knobs.at("lod_error_px").is_null()) finest = triangles.value_or(0.0);
    curve.push_back({{"error_px", number_at(point, "knobs.lod_error_px").value_or(0.0)},
                     {"triangles", triangles ? Json(*triangles) : Json()},
                     {"traced_ratio", triangles && finest > 0 ? Json(*triangles / finest) : Json()},
                     {"ao", point.at("ao")},
                     {"mrays_per_s", point.at("mrays_per_s")},
                     {"ms_per_frame", point.at("ms_per_frame")}});
  }
  const auto by_error = [](const Json& a, const Json& b) { return a.at("error_px") < b.at("error_px"); };
  std::stable_sort(curve.begin(), curve.end(), by_error);
  return curve;
}

nlohmann::json counts_of(const nlohmann::json& points) {
  uint64_t ok = 0, failed = 0, reused = 0;
  for (const Json& point : points) {
    const bool applies = point.at("status") != "not-applicable";
    ok += point.at("status") == "ok";
    failed += applies && point.at("status") != "ok";
    reused += point.at("reused").get<bool>();
  }
  return {{"points", points.size()}, {"ok", ok}, {"failed", failed}, {"reused", reused}};
}

std::string csv_of(const nlohmann::json& points) {
  std::string text;
  for (size_t i = 0; i < kColumns.size(); ++i) text += std::string(i > 0 ? "," : "") + kColumns[i].first;
  text += "\n";
  for (const Json& point : points) {
    for (size_t i = 0; i < kColumns.size(); ++i) {
      const std::string path = kColumns[i].second;
      text += (i > 0 ? "," : "") + csv_field(path.empty() ? positions_text(point) : value_at(point, path));
    }
    text += "\n";
  }
  return text;
}

} // namespace packtrace
