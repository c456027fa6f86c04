#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "runtime/view/view_session.h"

namespace packtrace {

/// A frame of a profile.
struct ProfileRow {
  ViewFrame frame;
  double total_ms = 0.0; ///< wall time with the picture for the screen
};

/// Renders frames while the camera turns once about its pivot, and measures them.
/// @param frames at least 1
/// Throws as ViewSession::step() does; Error(kCancelled) also if the progress' observer cancels a frame.
std::vector<ProfileRow> profile_orbit(ViewSession& session, uint32_t frames, Progress& progress);

/// A line per frame, with a header: milliseconds of each pass, rays, frames of history, traced pixels.
std::string profile_csv(const std::vector<ProfileRow>& rows);

/// The medians, 99th percentiles and sums of the rows, and the rows.
nlohmann::json profile_json(const std::vector<ProfileRow>& rows);

} // namespace packtrace
