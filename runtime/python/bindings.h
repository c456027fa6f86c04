#pragma once

namespace pybind11 {
class module_;
}

namespace packtrace {

/// Adds File and open() to the module.
void bind_files(pybind11::module_& module);

/// Adds render(); after bind_files().
void bind_rendering(pybind11::module_& module);

} // namespace packtrace
