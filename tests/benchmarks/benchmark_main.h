#pragma once

#include <exception>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include "pbrt_import/scene/error.h"

namespace packtrace {

/// Where `--json` writes a benchmark's figures.
class FiguresFile {
public:
  /// @param file none if empty
  /// @throws Error of kind kIo at once, not after the minutes that measuring takes
  explicit FiguresFile(const std::filesystem::path& file) : file_(file) {
    if (!file_.empty()) out_.open(file_);
    require_written();
  }
  template <class Json>
  void write(const Json& figures) {
    if (out_.is_open()) out_ << figures.dump(2) << std::endl;
    require_written();
  }

private:
  void require_written() const {
    if (!out_) throw Error(ErrorKind::kIo, file_.string() + ": cannot write");
  }

  std::filesystem::path file_;
  std::ofstream out_;
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
