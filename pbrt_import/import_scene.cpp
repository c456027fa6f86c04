#include "pbrt_import/import_scene.h"

#include <cmath>
#include <string>

#include "pbrt_import/base/file_error.h"
#include "pbrt_import/builder/scene_builder.h"
#include "pbrt_import/language/file_names.h"
#include "pbrt_import/language/parser.h"
#include "pbrt_import/mesh_files/mesh_files.h"
#include "pbrt_import/text/problem_text.h"
#include "pbrt_import/text/reporter.h"
#include "pbrt_import/text/source_stack.h"

namespace packtrace {
namespace {

void check_options(const ImportOptions& options) {
  const auto require = [](bool ok, const char* what) {
    if (!ok) throw Error(ErrorKind::kUsage, std::string("import options: ") + what);
  };
  require(options.max_include_depth >= 1, "max_include_depth must be at least 1");
  require(options.max_included_files >= 1, "max_included_files must be at least 1");
  require(options.max_nesting >= 1, "max_nesting must be at least 1");
  require(options.max_file_bytes >= 1, "max_file_bytes must be at least 1");
  require(!options.world || *options.world >= 1, "worlds are numbered from 1");
  require(!options.time || std::isfinite(*options.time), "the time must be finite");
  require(options.tessellation_tolerance >= 1e-6 && options.tessellation_tolerance <= 0.5,
          "tessellation_tolerance must lie within [1e-6, 0.5]");
  require(!options.frames_per_second || (std::isfinite(*options.frames_per_second) && *options.frames_per_second > 0.0),
          "frames_per_second must be finite and positive");
  require(options.mesh_scale >= 1e-30 && options.mesh_scale <= 1e30, "mesh_scale must lie within [1e-30, 1e30]");
}

/// Strict mode: throws Error(kInput) for the first warning or error.
void require_clean(const Diagnostics& diagnostics) {
  const uint64_t problems = diagnostics.count(Severity::kError) + diagnostics.count(Severity::kWarning);
  if (problems == 0) return;
  for (const Diagnostic& diagnostic : diagnostics.entries()) {
    if (diagnostic.severity == Severity::kNote) continue;
    throw FileError(ErrorKind::kInput, diagnostic.location,
                    diagnostic.message + " (" + std::to_string(problems) +
                        " problems in all, not accepted in strict mode)");
  }
}

/// Executes the directives of a pbrt scene; returns the position of its end.
Place read_pbrt(SourceStack& source, Parser& parser, SceneBuilder& builder, Reporter& reporter, Progress& progress) {
  Directive directive;
  constexpr uint64_t kProgressStep = 1024; // directives
  uint64_t reported_bytes = 0;
  const auto next = [&] {
    return with_place(reporter, [&] { return source.place(); }, [&] { return parser.next(directive); });
  };
  for (uint64_t count = 0; next(); ++count) {
    with_place(reporter, [&] { return directive.place; }, [&] { builder.handle(directive); });
    if (count % kProgressStep != 0) continue;
    const uint64_t bytes = source.bytes_read();
    progress.advance(bytes - reported_bytes);
    reported_bytes = bytes;
  }
  return source.place();
}

/// What imports of all formats share.
struct Import {
  Import(const std::filesystem::path& main_file, const ImportOptions& import_options, Diagnostics& problems,
         Progress& import_progress)
      : options(import_options), diagnostics(problems), progress(import_progress), reporter(files, problems),
        file_names(main_file.parent_path(), import_options.allow_files_outside_scene_folder),
        builder(import_options, file_names, reporter, import_progress) {}

  /// @param end position of the end of the input
  ImportResult finish(const Place& end) {
    reporter.next_directive(); // sorts reports of missing ends after all others
    ImportResult result = builder.finish(end, progress);
    reporter.finish();
    for (const Severity severity : {Severity::kNote, Severity::kWarning, Severity::kError})
      result.statistics.problems[static_cast<size_t>(severity)] = diagnostics.count(severity);
    if (options.strict) require_clean(diagnostics);
    return result;
  }

  const ImportOptions& options;
  Diagnostics& diagnostics;
  Progress& progress;
  SourceFiles files;
  Reporter reporter;
  FileNames file_names;
  SceneBuilder builder;
};

} // namespace

ImportResult import_scene(const std::filesystem::path& main_file, const ImportOptions& options,
                          Diagnostics& diagnostics, Progress& progress) {
  if (scene_format(main_file) != SceneFormat::kPbrt)
    return import_mesh_files({&main_file, 1}, options, diagnostics, progress);
  check_options(options);
  Import import(main_file, options, diagnostics, progress);
  const SourceLimits limits{options.max_include_depth, options.max_included_files, options.max_file_bytes};
  SourceStack source(main_file, limits, import.files, import.reporter);
  std::error_code error;
  const uint64_t main_bytes = std::filesystem::file_size(main_file, error);
  progress.begin("reading scene", error ? 0 : main_bytes);
  Parser parser(source, import.file_names, import.reporter, options.memory);
  const Place end = read_pbrt(source, parser, import.builder, import.reporter, progress);
  ImportResult result = import.finish(end);
  result.files.push_back(main_file);
  result.statistics.files_read += source.files_opened();
  result.statistics.bytes_read += source.bytes_read();
  return result;
}

ImportResult import_mesh_files(std::span<const std::filesystem::path> files, const ImportOptions& options,
                               Diagnostics& diagnostics, Progress& progress) {
  check_options(options);
  Import import(std::filesystem::absolute(files[0]), options, diagnostics, progress);
  DirectiveFeed feed(import.builder, import.reporter, options.memory);
  ImportStatistics read;
  std::vector<std::filesystem::path> named;
  MeshFiles mesh_files(files, {options, feed, import.files, import.file_names, read, named, progress});
  const Place end = mesh_files.read();
  ImportResult result = import.finish(end);
  result.files.insert(result.files.end(), named.begin(), named.end());
  result.statistics.files_read += read.files_read;
  result.statistics.bytes_read += read.bytes_read;
  return result;
}

} // namespace packtrace
