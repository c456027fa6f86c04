#pragma once

#include <stdexcept>
#include <string>

namespace packtrace {

/// Category of an error; the value is the exit code that main() returns for it.
enum class ErrorKind : int {
  kUsage = 2,         ///< bad command line or out-of-range option
  kInput = 3,         ///< malformed, missing or damaged input file
  kUnsupported = 4,   ///< well formed, but not supported by this version
  kLimitExceeded = 5, ///< an accuracy or size limit was exceeded
  kIo = 6,            ///< reading or writing failed, or the output already exists
  kCancelled = 7,     ///< interrupted by the user
};

/// Exception type of the project (with its subclasses) for bad input, I/O and devices; programming errors are asserts.
/// what() is a complete message; if it concerns a file, it starts with "file:line:column: " or "file: ".
class Error : public std::runtime_error {
public:
  Error(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}
  ErrorKind kind() const { return kind_; }
  int exit_code() const { return static_cast<int>(kind_); }

private:
  ErrorKind kind_;
};

} // namespace packtrace
