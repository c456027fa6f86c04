#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "runtime/measure/knobs.h"

namespace packtrace {

enum class TargetKind : uint8_t { kAoError, kPositionError, kNormalError, kSize };

/// A limit that a file must satisfy.
struct Target {
  TargetKind kind = TargetKind::kAoError;
  double limit = 0.0; ///< mean absolute AO error, object units, degrees, or bytes
};

/// Parses "NAME=VALUE" with the names ao-error, position-error, normal-error (degrees) and size (bytes, or with kB, MB,
/// GB, KiB, MiB, GiB). Throws Error(kUsage) for unknown names and units, and for values that are not positive and
/// finite.
Target parse_target(const std::string& text);

/// Name of a kind on the command line.
const char* name_of(TargetKind kind);

/// The value of a point of a report that a target limits; none if it was not measured.
std::optional<double> measured(const Target& target, const nlohmann::json& point);
bool keeps(const Target& target, const nlohmann::json& point);

/// The search space.
struct TargetSearch {
  std::vector<Target> targets;
  BakeKnobs base;           ///< knobs that the search does not change, and starts from
  bool free_grid = true;    ///< whether positions may be varied
  bool free_normals = true; ///< whether normals may be varied
};

struct TargetResult {
  std::vector<nlohmann::json> tried; ///< points of a report, in order
  std::vector<BakeKnobs> knobs;      ///< of the tried points
  std::optional<size_t> best;        ///< none if no tried point keeps all targets
};

/// Searches for the smallest file that keeps all targets, by bisection over the bits of positions and a choice of
/// normal encodings. If size is the only target, it searches for the finest positions within it instead.
/// Only measured points count; nothing is predicted. Errors are assumed to fall with more bits.
/// @param measure returns a point of a report; a point whose status is not "ok" keeps no target
TargetResult search_target(const TargetSearch& search,
                           const std::function<nlohmann::json(const BakeKnobs& knobs)>& measure);

/// A human-readable table of the tried points, one per line.
std::string to_text(const TargetResult& result, std::span<const Target> targets);

} // namespace packtrace
