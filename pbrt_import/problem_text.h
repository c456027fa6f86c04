#pragma once

#include <new>
#include <stdexcept>
#include <string>

#include "pbrt_import/scene/error.h"

namespace packtrace {

/// Runs work on one file or shape; what goes wrong with it becomes the text of its problem, empty if nothing does.
/// Throws Error(kCancelled) on.
template <class Work>
std::string problem_of(Work work) {
  try {
    work();
    return {};
  } catch (const Error& error) {
    if (error.kind() == ErrorKind::kCancelled) throw;
    return error.what();
  } catch (const std::bad_alloc&) {
    return "not enough memory";
  } catch (const std::length_error&) {
    return "not enough memory";
  }
}

} // namespace packtrace
