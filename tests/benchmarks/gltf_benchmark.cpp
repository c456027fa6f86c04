// Compares the import of glTF files with tinygltf, which parses the document, copies its buffers and decodes its images
// but makes no scene of them, and with cgltf, if the build has found it, which leaves images coded as well. Documented
// in docs/import_speed.md.

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <tiny_gltf.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/import_scene.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/gltf_benchmark_cgltf.h"

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

/// CPU time of all threads, which other programs on the machine change less than wall time.
template <class Load>
double cpu_seconds_of(const Load& load) {
  const auto now = [] {
    timespec time{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
  };
  const double before = now();
  load();
  return now() - before;
}

/// Shortest times of one file in seconds; without cgltf infinite.
struct Times {
  double cgltf = std::numeric_limits<double>::infinity(), tinygltf = cgltf, packtrace = cgltf;
};

Times measure(const std::string& file, int runs) {
  Times best;
  const auto keep = [](double& least, double seconds) { least = std::min(least, seconds); };
  for (int i = 0; i < runs; ++i) { // in turn, so that all see the same load
    if (has_cgltf()) keep(best.cgltf, cpu_seconds_of([&] { load_with_cgltf(file); }));
    keep(best.tinygltf, cpu_seconds_of([&] { load_with_tinygltf(file); }));
    keep(best.packtrace, cpu_seconds_of([&] { import_with_packtrace(file); }));
  }
  return best;
}

int run(int argc, char** argv) {
  std::vector<std::string> files;
  std::filesystem::path json;
  int runs = 9;
  BenchmarkOptions command_line("Compares the CPU time of the import of glTF files with tinygltf's and cgltf's");
  command_line.add("FILE", files, "glTF files without compression").required();
  command_line.add("--runs", runs, "Runs of each; the fastest counts (default 9)").range(1, 100);
  command_line.add("--json", json, "Write the figures to this file");
  if (const std::optional<int> code = command_line.parse(argc, argv)) return *code;
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  FiguresFile figures(json);
  nlohmann::json results = nlohmann::json::array();
  for (const std::string& file : files) {
    const Times times = measure(file, runs);
    const auto bytes = std::filesystem::file_size(file);
    fmt::print("{}: {:.1f} MB; tinygltf {:.2f} ms, packtrace {:.2f} ms, ratio {:.2f}", file,
               static_cast<double>(bytes) * 1e-6, times.tinygltf * 1e3, times.packtrace * 1e3,
               times.packtrace / times.tinygltf);
    if (has_cgltf()) fmt::print("; cgltf {:.2f} ms, ratio {:.2f}", times.cgltf * 1e3, times.packtrace / times.cgltf);
    fmt::print("\n");
    results.push_back(
        {{"file", file}, {"bytes", bytes}, {"tinygltf_s", times.tinygltf}, {"packtrace_s", times.packtrace}});
    if (has_cgltf()) results.back()["cgltf_s"] = times.cgltf;
  }
  figures.write(results);
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("gltf_benchmark", packtrace::run, argc, argv); }
