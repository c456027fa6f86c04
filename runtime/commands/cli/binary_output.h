#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "pbrt_import/base/output_file.h"
#include "runtime/commands/cli/json_output.h"

namespace packtrace {

/// The single output of a verb: a file, or standard output for "-". Construct it before the work starts, so that an
/// unwritable target is reported at once.
class BinaryOutput {
public:
  /// Throws like OutputFile, and Error(kUsage) for "-" if standard output is a terminal or already used by --json.
  BinaryOutput(const std::string& target, bool force, const JsonOutput& json);

  /// Writes a part of the output. Throws Error(kIo) if writing fails.
  void append(std::span<const std::byte> bytes);
  /// Writes the rest of the output; call it once. Throws like append().
  void write(std::span<const std::byte> bytes);

  /// Stream for human-readable text: standard output, or standard error if the bytes go to standard output.
  std::FILE* text_stream() const { return file_ ? stdout : stderr; }
  /// Name of the output for messages.
  std::string name() const { return file_ ? file_->target().string() : "standard output"; }

private:
  std::optional<OutputFile> file_;
};

/// Throws Error(kUsage) if -o - and --json - would both write to standard output.
void refuse_shared_stdout(bool output_to_stdout, const JsonOutput& json);

/// Writes all bytes to standard output. Throws Error(kIo) if that fails.
void write_standard_output(std::span<const std::byte> bytes);

/// Throws Error(kUsage) if standard output is a terminal.
/// @param what the kind of data for the message, such as "a PNG"
void refuse_terminal(const std::string& what);

/// Throws Error(kUsage) for a missing -o, with an example command line.
/// @param ending extension of the file in the example, such as ".ptk"
[[noreturn]] void fail_without_output(const std::string& verb, const std::string& input, const std::string& ending);

} // namespace packtrace
