#pragma once

namespace packtrace {

/// Whether c can be a component of a unit vector, with some room for rounding. False for NaN.
inline bool is_unit_component(float c) { return (c >= -2.0f) & (c <= 2.0f); }

} // namespace packtrace
