#pragma once

#include <exception>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/base/output_file.h"

namespace packtrace {

/// Where `--json` writes a benchmark's figures: whole or not at all, in the place of what was there.
class FiguresFile {
public:
  /// @param file none if empty
  /// @throws Error like OutputFile, at once and not after the minutes that measuring takes
  explicit FiguresFile(const std::filesystem::path& file) {
    if (!file.empty()) file_.emplace(file, true);
  }
  template <class Json>
  void write(const Json& figures) {
    if (!file_) return;
    const std::string text = figures.dump(2) + "\n";
    write_file_bytes(file_->path(), std::as_bytes(std::span(text)));
    file_->commit();
  }

private:
  std::optional<OutputFile> file_;
};

/// main() of a benchmark: run(argc, argv), its errors to stderr behind the name.
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
