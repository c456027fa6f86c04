#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/output_file.h"

namespace packtrace {

/// Where --json goes. Made before the work starts, so that a target that cannot be written is known at once.
class JsonOutput {
public:
  /// @param destination a file, "-" for standard output, empty for nowhere
  /// Throws like OutputFile, and Error(kUsage) for endings of other formats: `--json room.ptk`.
  JsonOutput(const std::string& destination, bool force);

  /// Something is to be written.
  bool wanted() const { return file_ || to_stdout_; }
  /// Standard output is taken: text for people does not belong there.
  bool to_stdout() const { return to_stdout_; }

  /// Writes the document, indented by 2, with a final newline. NaN and infinities become null, bytes that are not
  /// UTF-8 become U+FFFD. Throws Error(kIo) where writing fails.
  void write(const nlohmann::json& document);

private:
  std::optional<OutputFile> file_;
  bool to_stdout_ = false;
};

/// What the "error" key holds (docs/json_output.md).
nlohmann::json error_json(const Error& error);

/// The same of a failure that has no Error: "internal", or lack of memory.
nlohmann::json error_json(const std::string& kind, int exit_code, const std::string& message);

} // namespace packtrace
