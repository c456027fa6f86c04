// Compares the import of glTF files with tinygltf, which parses the document and copies its buffers and images but
// makes no scene of them. Documented in docs/import_speed.md.

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <tiny_gltf.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/import_scene.h"
#include "runtime/stopwatch.h"
#include "tests/benchmarks/benchmark_main.h"

namespace packtrace {
namespace {

/// Loads a file with tinygltf; images are decoded as its default is.
void load_with_tinygltf(const std::string& file) {
  tinygltf::Model model;
  std::string errors, warnings;
  tinygltf::TinyGLTF loader;
  const bool binary = std::filesystem::path(file).extension() == ".glb";
  if (!(binary ? loader.LoadBinaryFromFile(&model, &errors, &warnings, file)
               : loader.LoadASCIIFromFile(&model, &errors, &warnings, file)))
    throw Error(ErrorKind::kInput, file + ": " + errors);
}

ImportStatistics import_with_packtrace(const std::string& file) {
  ImportOptions options;
  options.keep_textures = true;
  Diagnostics diagnostics;
  Progress progress;
  return import_scene(file, options, diagnostics, progress).statistics;
}

template <class Load>
double seconds_of(const Load& load) {
  const Stopwatch watch;
  load();
  return watch.seconds();
}

int run(int argc, char** argv) {
  std::vector<std::string> files;
  std::filesystem::path json;
  int runs = 5;
  CLI::App app("Compares the import of glTF files with tinygltf");
  app.add_option("FILE", files, "glTF files without compression")->required();
  app.add_option("--runs", runs, "Runs of each; the fastest counts (default 5)")->check(CLI::Range(1, 100));
  app.add_option("--json", json, "Write the figures to this file");
  if (const std::optional<int> code = parse_arguments(app, argc, argv)) return *code;
  FiguresFile figures(json);
  nlohmann::json results = nlohmann::json::array();
  for (const std::string& file : files) {
    double tiny = std::numeric_limits<double>::infinity(), ours = tiny;
    for (int i = 0; i < runs; ++i) { // in turn, so that both see the same load
      tiny = std::min(tiny, seconds_of([&] { load_with_tinygltf(file); }));
      ours = std::min(ours, seconds_of([&] { import_with_packtrace(file); }));
    }
    const double megabytes = static_cast<double>(std::filesystem::file_size(file)) * 1e-6;
    fmt::print("{}: {:.1f} MB; tinygltf {:.1f} ms, packtrace {:.1f} ms, ratio {:.2f}\n", file, megabytes, tiny * 1e3,
               ours * 1e3, ours / tiny);
    results.push_back(
        {{"file", file}, {"bytes", std::filesystem::file_size(file)}, {"tinygltf_s", tiny}, {"packtrace_s", ours}});
  }
  figures.write(results);
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("gltf_benchmark", packtrace::run, argc, argv); }
