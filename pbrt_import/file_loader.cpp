#include "pbrt_import/file_loader.h"

#include <algorithm>
#include <atomic>
#include <memory>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "pbrt_import/input_file.h"
#include "pbrt_import/large_pages.h"
#include "pbrt_import/ply.h"
#include "pbrt_import/problem_text.h"
#include "pbrt_import/scene/error.h"
#include "pbrt_import/tokenizer.h"

namespace packtrace {
uint32_t FileLoader::request_ply(const std::filesystem::path& path, const Place& place, uint32_t slot) {
  const auto [it, inserted] = ply_by_path_.try_emplace(path.string(), static_cast<uint32_t>(plys_.size()));
  if (inserted) {
    plys_.push_back({path, slot, false, {}, {}});
    ply_by_slot_.emplace(slot, it->second);
  }
  PlyFile& file = plys_[it->second];
  file.uses.push_back({place, reporter_.sequence()});
  return file.slot;
}

void FileLoader::require(uint32_t slot) {
  if (const auto it = ply_by_slot_.find(slot); it != ply_by_slot_.end()) plys_[it->second].needed = true;
}

void FileLoader::read_ply_file(PlyFile& file, Mesh& mesh) const {
  Outcome& outcome = file.outcome;
  outcome.error = problem_of([&] {
    const std::vector<std::byte> bytes = read_whole_file(file.path, options_.memory_budget_bytes);
    outcome.bytes = bytes.size();
    PlyMesh ply = read_ply(bytes, [&](Severity severity, uint32_t line, std::string message) {
      outcome.reports.push_back({severity, line, std::move(message)});
    });
    outcome.dropped_triangles = ply.dropped_triangles;
    if (ply.mesh.triangles.empty()) throw Error(ErrorKind::kInput, "no triangle is left");
    mesh = std::move(ply.mesh);
    mesh.name = file.path.filename().string();
  });
}

FileLoader::Outcome FileLoader::read_image_file(ImageRequest& image) const {
  Outcome outcome;
  outcome.error = problem_of([&] {
    const std::vector<std::byte> bytes = read_whole_file(image.path, options_.memory_budget_bytes);
    outcome.bytes = bytes.size();
    image.summary =
        read_image(bytes, image.decode_srgb, {image.want_mask, image.want_colours}, options_.memory_budget_bytes);
  });
  image.missing = !outcome.error.empty();
  return outcome;
}

void FileLoader::load(std::vector<Mesh>& meshes, std::vector<ImageRequest>& images, Progress& progress,
                      ImportStatistics& statistics, uint64_t& dropped_triangles) {
  std::vector<PlyFile*> wanted_plys;
  for (PlyFile& file : plys_)
    if (file.needed) wanted_plys.push_back(&file);
  std::vector<ImageRequest*> wanted_images;
  for (ImageRequest& image : images)
    if (image.needed && !image.missing) wanted_images.push_back(&image);
  std::vector<Outcome> image_outcomes(wanted_images.size());
  const size_t count = wanted_images.size() + wanted_plys.size();
  std::atomic<uint64_t> mesh_bytes{0}, colour_bytes{0};
  for (const Mesh& mesh : meshes) mesh_bytes += bytes_of(mesh);
  tbb::enumerable_thread_specific<LargeHeapPages> heap_pages;
  progress.begin("reading meshes and images", count);
  tbb::parallel_for(size_t{0}, count, [&](size_t i) {
    if (i < wanted_images.size()) { // images first: one may take longer than many meshes
      image_outcomes[i] = read_image_file(*wanted_images[i]);
      const uint64_t bytes = wanted_images[i]->summary.rgb.size();
      if (colour_bytes.fetch_add(bytes) + bytes > options_.memory_budget_bytes)
        throw Error(ErrorKind::kLimitExceeded, "all textures together exceed the memory budget of " +
                                                   std::to_string(options_.memory_budget_bytes) + " bytes");
    } else {
      PlyFile& file = *wanted_plys[i - wanted_images.size()];
      std::error_code unknown; // found out when it is read
      const uint64_t stored_bytes = std::filesystem::file_size(file.path, unknown);
      if (!unknown) heap_pages.local().about_to_allocate(2 * stored_bytes);
      read_ply_file(file, meshes[file.slot]);
      // Leaving out those beyond the limit would leave out others in each run.
      const uint64_t bytes = bytes_of(meshes[file.slot]);
      if (mesh_bytes.fetch_add(bytes) + bytes > options_.memory_budget_bytes)
        throw Error(ErrorKind::kLimitExceeded, "all meshes together exceed the memory budget of " +
                                                   std::to_string(options_.memory_budget_bytes) + " bytes");
    }
    progress.advance();
  });
  for (size_t i = 0; i < wanted_images.size(); ++i) {
    report_image(*wanted_images[i], image_outcomes[i]);
    statistics.bytes_read += image_outcomes[i].bytes;
    statistics.files_read += image_outcomes[i].error.empty();
  }
  for (const PlyFile* const file : wanted_plys) {
    report_ply(*file);
    statistics.bytes_read += file->outcome.bytes;
    statistics.files_read += file->outcome.error.empty();
    if (!file->outcome.error.empty()) statistics.shapes_skipped += file->uses.size();
    dropped_triangles += file->outcome.dropped_triangles;
  }
}

void FileLoader::report_ply(const PlyFile& file) {
  for (const PlyUse& use : file.uses) {
    if (file.outcome.error.empty()) break;
    reporter_.set_sequence(use.sequence);
    reporter_.error(use.place, "plymesh " + in_quotes(file.path.string(), kMaxShownPath) + ": " + file.outcome.error +
                                   "; the shape is skipped");
  }
  if (file.outcome.reports.empty()) return;
  reporter_.set_sequence(file.uses.front().sequence);
  const auto source =
      std::make_shared<SourceFile>(SourceFile{file.path.string(), reporter_.locate(file.uses.front().place)});
  for (const Report& report : file.outcome.reports)
    reporter_.report(report.severity, SourceLocation{source, report.line, 0}, report.message);
}

void FileLoader::report_image(const ImageRequest& image, const Outcome& outcome) {
  reporter_.set_sequence(image.sequence);
  const std::string file = "texture file " + in_quotes(image.path.string(), kMaxShownPath) + ": ";
  if (!outcome.error.empty()) reporter_.error(image.place, file + outcome.error + "; it counts as white");
  for (const std::string& problem : image.summary.problems) reporter_.warning(image.place, file + problem);
}

} // namespace packtrace
