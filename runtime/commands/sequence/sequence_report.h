#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "runtime/commands/sequence/sequence_options.h"

namespace packtrace {

/// What is reported of a picture of a sequence.
struct PictureRow {
  uint64_t picture = 0;
  double time_s = 0.0;
  PassTimes times;
  double write_s = 0.0;
  uint64_t primary_rays = 0, ao_rays = 0;
  double mean_history = 0.0; ///< PictureReport::mean_history
  uint64_t builds = 0;       ///< LodPlan::builds; 0 without --lod-error
  uint64_t traced_triangles = 0;
  bool rebuilt = false;

  PictureRow() = default;
  /// @param detail null without --lod-error
  PictureRow(uint64_t number, double time, const PictureReport& report, const DetailPlanner* detail);
  double total_s() const { return times.total_s(); }
};

/// First line of the table of --csv, and the line of a picture.
std::string csv_header();
std::string csv_line(const PictureRow& row);

/// Number of pictures up to which sequence_json() lists each.
inline constexpr size_t kMaxListedPictures = 10'000;

/// The "sequence" report of `render --json` (docs/json_output.md).
nlohmann::json sequence_json(const Sequence& sequence, const std::vector<PictureRow>& rows);

/// Human-readable form of sequence_json().
std::string sequence_text(const nlohmann::json& report);

} // namespace packtrace
