#pragma once

#include <stdexcept>
#include <string>

namespace packtrace {

/// What went wrong, as the process exit code that main() returns for it.
enum class ErrorKind : int {
  kUsage = 2,         ///< bad command line or out-of-range option
  kInput = 3,         ///< malformed, missing or damaged input file
  kUnsupported = 4,   ///< well formed, but not something this version can do
  kLimitExceeded = 5, ///< an accuracy or size limit was not met
  kIo = 6,            ///< reading or writing failed, or the output exists already
  kCancelled = 7,     ///< interrupted by the user
};

/// The one exception type of the project: bad input, IO and devices. Programmer mistakes are asserts.
/// what() is complete as it stands; where a file is to blame it begins "file:line:column: " or "file: ".
class Error : public std::runtime_error {
public:
  Error(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}
  ErrorKind kind() const { return kind_; }
  int exit_code() const { return static_cast<int>(kind_); }

private:
  ErrorKind kind_;
};

} // namespace packtrace
