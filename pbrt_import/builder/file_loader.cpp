#include "pbrt_import/builder/file_loader.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <mutex>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/large_pages.h"
#include "pbrt_import/files/ply.h"
#include "pbrt_import/text/input_file.h"
#include "pbrt_import/text/problem_text.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

constexpr uint64_t kNoLimit = std::numeric_limits<uint64_t>::max() / 2; // only the memory budget limits file sizes

} // namespace

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
    MemoryReservation content(options_.memory);
    outcome.memory = MemoryReservation(options_.memory);
    const std::vector<std::byte> bytes = read_whole_file(file.path, kNoLimit, &content);
    outcome.bytes = bytes.size();
    const ReportFn report = [&](Severity severity, uint32_t line, std::string message) {
      outcome.reports.push_back({severity, line, std::move(message)});
    };
    PlyMesh ply = read_ply(bytes, report, &outcome.memory);
    outcome.dropped_triangles = ply.dropped_triangles;
    if (ply.mesh.triangles.empty()) throw Error(ErrorKind::kInput, "no triangle is left");
    ply.mesh.lattice = mesh.lattice; // the shape states it
    mesh = std::move(ply.mesh);
    mesh.name = file.path.filename().string();
  });
  outcome.memory.resize(bytes_of(mesh), "its mesh");
}

FileLoader::Outcome FileLoader::read_image_file(ImageRequest& image) const {
  Outcome outcome;
  outcome.error = problem_of([&] {
    MemoryReservation content(options_.memory);
    outcome.memory = MemoryReservation(options_.memory);
    std::vector<std::byte> file;
    if (image.embedded.empty()) file = read_whole_file(image.path, kNoLimit, &content);
    outcome.bytes = file.size();
    image.summary =
        read_image(image.embedded.empty() ? std::span<const std::byte>(file) : image.embedded, image.decode_srgb,
                   {image.want_mask, image.want_colours, image.want_radiance, image.alpha_cutoff, image.grey_cutoff},
                   outcome.memory);
  });
  outcome.memory.resize(bytes_of(image.summary), "its pixels");
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
  tbb::enumerable_thread_specific<LargeHeapPages> heap_pages;
  progress.begin("reading meshes and images", count);
  std::mutex problem_mutex;
  const auto with_file = [&](const std::filesystem::path& path, const Place& place, const auto& work) {
    try {
      work();
    } catch (const MemoryError& error) {
      const std::scoped_lock lock(problem_mutex); // locate() caches its results
      throw MemoryError(reporter_.locate(place), in_quotes(path.string(), kMaxShownPath) + ": " + error.what());
    }
  };
  tbb::parallel_for(size_t{0}, count, [&](size_t i) {
    if (i < wanted_images.size()) { // images first: one image may take longer than many meshes
      ImageRequest& image = *wanted_images[i];
      with_file(image.path, image.place, [&] { image_outcomes[i] = read_image_file(image); });
    } else {
      PlyFile& file = *wanted_plys[i - wanted_images.size()];
      std::error_code unknown; // a missing file is reported when it is read
      const uint64_t stored_bytes = std::filesystem::file_size(file.path, unknown);
      if (!unknown) heap_pages.local().about_to_allocate(2 * stored_bytes);
      // A file over the budget ends the import. Skipping it would skip different files in each run, because threads
      // compete for the budget.
      with_file(file.path, file.uses.front().place, [&] { read_ply_file(file, meshes[file.slot]); });
    }
    progress.advance();
  });
  for (size_t i = 0; i < wanted_images.size(); ++i) {
    report_image(*wanted_images[i], image_outcomes[i]);
    statistics.bytes_read += image_outcomes[i].bytes;
    statistics.files_read += image_outcomes[i].error.empty() && wanted_images[i]->embedded.empty();
  }
  for (const PlyFile* const file : wanted_plys) {
    report_ply(*file);
    statistics.bytes_read += file->outcome.bytes;
    statistics.files_read += file->outcome.error.empty();
    if (!file->outcome.error.empty()) statistics.shapes_skipped += file->uses.size();
    dropped_triangles += file->outcome.dropped_triangles;
  }
  for (PlyFile* const file : wanted_plys) memory_.merge(std::move(file->outcome.memory));
  // The image reservations move to their requests, since most are released once the textures are made.
  for (size_t i = 0; i < wanted_images.size(); ++i) wanted_images[i]->memory = std::move(image_outcomes[i].memory);
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
