#pragma once

#include <nlohmann/json.hpp>

namespace packtrace {

/// Where figures come from: "cpu" (model), "hardware_threads", "load_average" (over a minute), and "commit" of the
/// source tree where it is a checkout, else "unknown".
nlohmann::json describe_machine();

} // namespace packtrace
