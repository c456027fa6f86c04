#pragma once

#include <nlohmann/json_fwd.hpp>

namespace packtrace {

/// Answers the five questions of a report (docs/measure.md) from its measured points.
/// @param report with points, settings, default_id, convergence and tiles
/// @param max_error mean absolute AO error that the user accepts
/// @return "answers" of the report
nlohmann::json answer_questions(const nlohmann::json& report, double max_error);

} // namespace packtrace
