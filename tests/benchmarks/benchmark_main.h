#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "pbrt_import/base/output_file.h"

namespace packtrace {

/// An optional output file. It is written completely or not at all, and replaces an existing file.
class TextFile {
public:
  /// @param file empty: no output
  /// @throws Error like OutputFile; at construction, so that a bad path fails before minutes of measuring
  explicit TextFile(const std::filesystem::path& file);
  void write(const std::string& text);

private:
  std::optional<OutputFile> file_;
};

/// Output file of `--json`.
class FiguresFile {
public:
  explicit FiguresFile(const std::filesystem::path& file) : file_(file) {}
  void write(const nlohmann::json& figures);
  void write(const nlohmann::ordered_json& figures);

private:
  TextFile file_;
};

/// Implements main() of a benchmark: calls run(argc, argv) and prints its errors to stderr after the name.
/// @return the exit code
int benchmark_main(const char* name, int (*run)(int, char**), int argc, char** argv);

} // namespace packtrace
