#include "pbrt_import/import_scene.h"

#include <cmath>
#include <string>

#include "pbrt_import/base/file_error.h"
#include "pbrt_import/builder/scene_builder.h"
#include "pbrt_import/language/file_names.h"
#include "pbrt_import/language/parser.h"
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

} // namespace

ImportResult import_scene(const std::filesystem::path& main_file, const ImportOptions& options,
                          Diagnostics& diagnostics, Progress& progress) {
  check_options(options);
  SourceFiles files;
  Reporter reporter(files, diagnostics);
  const SourceLimits limits{options.max_include_depth, options.max_included_files, options.max_file_bytes};
  SourceStack source(main_file, limits, files, reporter);
  std::error_code error;
  const uint64_t main_bytes = std::filesystem::file_size(main_file, error);
  progress.begin("reading scene", error ? 0 : main_bytes);
  FileNames file_names(main_file.parent_path(), options.allow_files_outside_scene_folder);
  Parser parser(source, file_names, reporter, options.memory);
  SceneBuilder builder(options, file_names, reporter, progress);
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
  reporter.next_directive(); // sorts reports of missing ends after all others
  ImportResult result = builder.finish(source.place(), progress);
  result.files.push_back(main_file);
  result.statistics.files_read += source.files_opened();
  result.statistics.bytes_read += source.bytes_read();
  reporter.finish();
  for (const Severity severity : {Severity::kNote, Severity::kWarning, Severity::kError})
    result.statistics.problems[static_cast<size_t>(severity)] = diagnostics.count(severity);
  if (options.strict) require_clean(diagnostics);
  return result;
}

} // namespace packtrace
