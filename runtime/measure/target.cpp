#include "runtime/measure/target.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/measure/report.h"

namespace packtrace {
namespace {

struct KindName {
  const char *name, *path;
};
constexpr std::array<KindName, 4> kKinds{{{"ao-error", "ao.mae"},
                                          {"position-error", "position.max"},
                                          {"normal-error", "normal.max_degrees"},
                                          {"size", "bytes.file"}}};        // indexed by TargetKind
constexpr uint32_t kMinBits = 4, kMaxBits = 24;                            // floats have no more
constexpr double kFinestNormalError = 0.0025, kCoarsestNormalError = 10.0; // degrees; limits of bake

double unit_of(const std::string& text, const std::string& unit) {
  constexpr std::array<std::pair<const char*, double>, 9> kUnits{{{"", 1.0},
                                                                  {"B", 1.0},
                                                                  {"kB", 1e3},
                                                                  {"KB", 1e3},
                                                                  {"MB", 1e6},
                                                                  {"GB", 1e9},
                                                                  {"KiB", 1024.0},
                                                                  {"MiB", 1048576.0},
                                                                  {"GiB", 1073741824.0}}};
  for (const auto& [name, bytes] : kUnits)
    if (unit == name) return bytes;
  throw Error(ErrorKind::kUsage, "--target " + text + ": unknown unit '" + unit + "'; use kB, MB, GB, KiB, MiB or GiB");
}

class Searcher {
public:
  Searcher(const TargetSearch& search, const std::function<nlohmann::json(const BakeKnobs&)>& measure)
      : search_(search), measure_(measure) {
    for (const Target& target : search.targets) (target.kind == TargetKind::kSize ? sizes_ : errors_).push_back(target);
  }

  TargetResult run() {
    BakeKnobs knobs = search_.base;
    if (search_.free_normals) limit_normals(knobs);
    const bool only_size = errors_.empty();
    const bool grid_matters =
        only_size || std::ranges::any_of(errors_, [](const Target& t) { return t.kind != TargetKind::kNormalError; });
    const size_t first = try_point(knobs);
    if (!search_.free_grid || !grid_matters) {
      if (!kept(first, errors_) && search_.free_normals) try_normals(knobs, "axis32");
    } else if (only_size) {
      finest_within_size(knobs);
    } else {
      coarsest_within_error(knobs);
    }
    choose(only_size);
    return std::move(result_);
  }

private:
  /// The encoding that the user's limit of normals needs; auto measures it per geometry.
  void limit_normals(BakeKnobs& knobs) const {
    for (const Target& target : errors_)
      if (target.kind == TargetKind::kNormalError && target.limit >= kFinestNormalError)
        knobs.normal_error = std::min(target.limit, kCoarsestNormalError);
      else if (target.kind == TargetKind::kNormalError)
        knobs.normals = "axis32";
  }

  size_t try_point(const BakeKnobs& knobs) {
    const auto known = std::ranges::find(result_.knobs, knobs);
    if (known != result_.knobs.end()) return static_cast<size_t>(known - result_.knobs.begin());
    result_.tried.push_back(measure_(knobs));
    result_.knobs.push_back(knobs);
    return result_.tried.size() - 1;
  }

  size_t try_bits(BakeKnobs knobs, uint32_t bits) {
    knobs.grid = GridKind::kBits, knobs.grid_value = bits;
    return try_point(knobs);
  }

  void try_normals(BakeKnobs knobs, const char* normals) {
    knobs.normals = normals;
    knobs.normal_error.reset();
    try_point(knobs);
  }

  bool kept(size_t point, std::span<const Target> targets) const {
    return std::ranges::all_of(targets, [&](const Target& t) { return keeps(t, result_.tried[point]); });
  }

  void coarsest_within_error(const BakeKnobs& knobs) {
    if (!kept(try_bits(knobs, kMaxBits), errors_)) {
      if (search_.free_normals) try_normals(result_.knobs.back(), "axis32");
      return;
    }
    uint32_t failing = kMinBits - 1, passing = kMaxBits;
    while (passing - failing > 1) {
      const uint32_t middle = (failing + passing) / 2;
      (kept(try_bits(knobs, middle), errors_) ? passing : failing) = middle;
    }
    if (!search_.free_normals || knobs.normal_error || knobs.normals != "auto") return;
    for (const uint32_t bits : {passing, std::min(passing + 1, kMaxBits)}) {
      BakeKnobs coarse = knobs;
      coarse.grid = GridKind::kBits, coarse.grid_value = bits;
      try_normals(coarse, "axis16");
    }
  }

  void finest_within_size(const BakeKnobs& knobs) {
    if (!kept(try_bits(knobs, kMinBits), sizes_)) return;
    uint32_t passing = kMinBits, failing = kMaxBits + 1;
    while (failing - passing > 1) {
      const uint32_t middle = (failing + passing) / 2;
      (kept(try_bits(knobs, middle), sizes_) ? passing : failing) = middle;
    }
  }

  void choose(bool finest) {
    const auto cost = [&](size_t i) {
      const nlohmann::json& point = result_.tried[i];
      return number_at(point, finest ? "position.rms" : "bytes.file").value_or(INFINITY);
    };
    for (size_t i = 0; i < result_.tried.size(); ++i)
      if (kept(i, search_.targets) && (!result_.best || cost(i) < cost(*result_.best))) result_.best = i;
  }

  const TargetSearch& search_;
  const std::function<nlohmann::json(const BakeKnobs&)>& measure_;
  std::vector<Target> errors_, sizes_;
  TargetResult result_;
};

} // namespace

const char* name_of(TargetKind kind) { return kKinds[static_cast<size_t>(kind)].name; }

Target parse_target(const std::string& text) {
  const size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  const auto kind = std::ranges::find_if(kKinds, [&](const KindName& k) { return name == k.name; });
  if (equals == std::string::npos || kind == kKinds.end())
    throw Error(ErrorKind::kUsage, "--target " + text +
                                       ": write ao-error=X, position-error=UNITS, normal-error=DEGREES or size=BYTES, "
                                       "for example size=3MB");
  Target target{static_cast<TargetKind>(kind - kKinds.begin()), 0.0};
  const char *begin = text.data() + equals + 1, *end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(begin, end, target.limit);
  const std::string unit(rest, end);
  if (error == std::errc() && target.kind == TargetKind::kSize) target.limit *= unit_of(text, unit);
  if (error != std::errc() || (target.kind != TargetKind::kSize && !unit.empty()) || !(target.limit > 0.0) ||
      !std::isfinite(target.limit))
    throw Error(ErrorKind::kUsage, "--target " + text + ": '" + std::string(begin, end) + "' is not a positive number" +
                                       (target.kind == TargetKind::kSize ? " of bytes" : ""));
  return target;
}

std::optional<double> measured(const Target& target, const nlohmann::json& point) {
  if (point.at("status") != "ok") return std::nullopt;
  return number_at(point, kKinds[static_cast<size_t>(target.kind)].path);
}

bool keeps(const Target& target, const nlohmann::json& point) {
  const std::optional<double> value = measured(target, point);
  return value && *value <= target.limit;
}

TargetResult search_target(const TargetSearch& search,
                           const std::function<nlohmann::json(const BakeKnobs& knobs)>& measure) {
  return Searcher(search, measure).run();
}

std::string to_text(const TargetResult& result, std::span<const Target> targets) {
  std::string text =
      fmt::format("{:<56}{:>12}{:>10}{:>12}{:>10}  {}\n", "tried", "bytes", "AO error", "position", "normal", "limits");
  for (size_t i = 0; i < result.tried.size(); ++i) {
    const nlohmann::json& point = result.tried[i];
    const Words words = words_of(result.knobs[i]);
    const bool kept = std::ranges::all_of(targets, [&](const Target& t) { return keeps(t, point); });
    const auto number = [&](const char* path) { return number_at(point, path).value_or(NAN); };
    text += fmt::format("{:<56}{:>12.0f}{:>10.2g}{:>12.3g}{:>9.3g}°  {}{}\n",
                        words.empty() ? "(default)" : shell_command(words), number("bytes.file"), number("ao.mae"),
                        number("position.max"), number("normal.max_degrees"),
                        point.at("status") != "ok" ? point.at("status").get<std::string>()
                        : kept                     ? "kept"
                                                   : "exceeded",
                        result.best == i ? ", chosen" : "");
  }
  return text;
}

} // namespace packtrace
