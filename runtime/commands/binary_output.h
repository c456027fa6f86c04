#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "pbrt_import/base/output_file.h"
#include "runtime/commands/json_output.h"

namespace packtrace {

/// Where a verb's one file goes: a file, or standard output for "-". Made before the work starts, so that a target that
/// cannot be written is known at once.
class BinaryOutput {
public:
  /// Throws like OutputFile, and Error(kUsage) for "-" where standard output is a terminal or carries the JSON.
  BinaryOutput(const std::string& target, bool force, const JsonOutput& json);

  /// Writes all of it, once. Throws Error(kIo) where that fails.
  void write(std::span<const std::byte> bytes);

  /// Where text for people goes: standard error where standard output has the bytes.
  std::FILE* text_stream() const { return file_ ? stdout : stderr; }
  /// For messages.
  std::string name() const { return file_ ? file_->target().string() : "standard output"; }

private:
  std::optional<OutputFile> file_;
};

/// Writes to standard output, all of it. Throws Error(kIo) where that fails.
void write_standard_output(std::span<const std::byte> bytes);

/// Throws Error(kUsage) where standard output is a terminal, which binary data would upset. @param what "a PNG"
void refuse_terminal(const std::string& what);

/// Throws Error(kUsage) for a verb without -o, with a command line to copy.
/// @param ending of the file to suggest: ".ptk"
[[noreturn]] void fail_without_output(const std::string& verb, const std::string& input, const std::string& ending);

} // namespace packtrace
