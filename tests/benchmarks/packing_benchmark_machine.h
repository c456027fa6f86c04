#pragma once

#include <nlohmann/json.hpp>

namespace packtrace {

/// Describes the origin of figures: "cpu" (model), "hardware_threads", "load_average" (one minute), and "commit" of the
/// source tree, or "unknown" if it is not a checkout.
nlohmann::json describe_machine();

} // namespace packtrace
