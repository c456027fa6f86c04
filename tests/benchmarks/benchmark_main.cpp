#include "tests/benchmarks/benchmark_main.h"

#include <exception>
#include <span>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/file_bytes.h"

namespace packtrace {

TextFile::TextFile(const std::filesystem::path& file) {
  if (!file.empty()) file_.emplace(file, true);
}

void TextFile::write(const std::string& text) {
  if (!file_) return;
  write_file_bytes(file_->path(), std::as_bytes(std::span(text)));
  file_->commit();
}

void FiguresFile::write(const nlohmann::json& figures) { file_.write(figures.dump(2) + "\n"); }
void FiguresFile::write(const nlohmann::ordered_json& figures) { file_.write(figures.dump(2) + "\n"); }

int benchmark_main(const char* name, int (*run)(int, char**), int argc, char** argv) {
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
