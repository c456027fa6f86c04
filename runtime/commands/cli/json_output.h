#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/output_file.h"

namespace packtrace {

/// The destination of --json. Construct it before the work starts, so that an unwritable target is reported at once.
class JsonOutput {
public:
  /// @param destination a file, "-" for standard output, empty for none
  /// Throws like OutputFile, and Error(kUsage) for extensions of other formats, such as `--json room.ptk`.
  JsonOutput(const std::string& destination, bool force);

  /// Whether JSON output was requested.
  bool wanted() const { return file_ || to_stdout_; }
  /// Whether JSON goes to standard output, so that human-readable text must go elsewhere.
  bool to_stdout() const { return to_stdout_; }

  /// Writes the document, indented by 2, with a final newline. Does nothing unless wanted(). NaN and infinities become
  /// null, bytes that are not UTF-8 become U+FFFD. Throws Error(kIo) if writing fails.
  void write(const nlohmann::json& document);

private:
  std::optional<OutputFile> file_;
  bool to_stdout_ = false;
};

/// Value of the "error" key (docs/json_output.md).
nlohmann::json error_json(const Error& error);

/// The same for failures that are not an Error, such as internal errors.
nlohmann::json error_json(const std::string& kind, int exit_code, const std::string& message);

} // namespace packtrace
