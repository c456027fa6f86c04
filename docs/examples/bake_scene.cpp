// Imports a pbrt-v3 scene and packs it to a .ptk file.
// Usage: bake_scene SCENE.pbrt OUT.ptk

#include <cstdio>

#include "compress/bake/bake_scene.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/import_scene.h"

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::fprintf(stderr, "usage: bake_scene SCENE.pbrt OUT.ptk\n");
    return 2;
  }
  packtrace::Diagnostics diagnostics; // problems that do not stop the work
  packtrace::Progress progress;       // pass an observer to show it; Progress::cancel() ends the work

  packtrace::ImportOptions import;
  import.keep_textures = true;
  const packtrace::ImportResult imported = packtrace::import_scene(argv[1], import, diagnostics, progress);

  // The defaults keep what ambient occlusion needs, at a precision that its images do not show. Here the file also
  // keeps what shading needs, and is compressed on disk.
  packtrace::BakeConfig config;
  config.purpose = packtrace::baked::kShading;
  config.textures = true;
  config.codec = packtrace::PageCodec::kSmall;
  const packtrace::BakeReport report =
      packtrace::bake_scene(imported.scene, config, argv[2], /*force=*/true, diagnostics, progress);

  for (const packtrace::Diagnostic& problem : diagnostics.entries())
    std::fprintf(stderr, "%s\n", to_string(problem).c_str());
  const packtrace::FileSummary& file = report.file;
  std::printf("%s: %llu triangles, %llu placed, in %llu clusters\n", argv[2],
              static_cast<unsigned long long>(file.triangles), static_cast<unsigned long long>(file.placed_triangles),
              static_cast<unsigned long long>(file.clusters));
  std::printf("%llu bytes on disk, %.2f bytes per triangle when traced\n",
              static_cast<unsigned long long>(file.disk.file_bytes), file.bytes_per_triangle);
  std::printf("largest errors: %.3g units of position, %.3g degrees of normals\n", report.max_position_error,
              report.max_normal_error_degrees);
  return 0;
} catch (const packtrace::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return error.exit_code();
}
