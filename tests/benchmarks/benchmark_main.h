#pragma once

#include <exception>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/base/output_file.h"

namespace packtrace {

/// An optional output file. It is written completely or not at all, and replaces an existing file.
class TextFile {
public:
  /// @param file empty: no output
  /// @throws Error like OutputFile; at construction, so that a bad path fails before minutes of measuring
  explicit TextFile(const std::filesystem::path& file) {
    if (!file.empty()) file_.emplace(file, true);
  }
  void write(const std::string& text) {
    if (!file_) return;
    write_file_bytes(file_->path(), std::as_bytes(std::span(text)));
    file_->commit();
  }

private:
  std::optional<OutputFile> file_;
};

/// Output file of `--json`.
class FiguresFile {
public:
  explicit FiguresFile(const std::filesystem::path& file) : file_(file) {}
  template <class Json>
  void write(const Json& figures) {
    file_.write(figures.dump(2) + "\n");
  }

private:
  TextFile file_;
};

/// Parses the command line. Returns the exit code if the program ends here: it only prints help, or an option is wrong.
inline std::optional<int> parse_arguments(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorKind::kUsage);
  }
  return std::nullopt;
}

/// Implements main() of a benchmark: calls run(argc, argv) and prints its errors to stderr after the name.
/// @return the exit code
template <class Run>
int benchmark_main(const char* name, Run run, int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const Error& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
    return error.exit_code();
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
    return 1;
  }
}

} // namespace packtrace
