#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "pbrt_import/import_scene.h"
#include "pbrt_import/language/texture_graph.h"
#include "pbrt_import/scene/scene.h"
#include "pbrt_import/text/reporter.h"

namespace packtrace {

/// Loads the PLY files that shapes request, each once. All PLY files and images are read in parallel after the scene
/// text.
class FileLoader {
public:
  FileLoader(const ImportOptions& options, Reporter& reporter) : options_(options), reporter_(reporter) {}

  /// Requests a PLY file for a shape.
  /// @param slot index in Scene::meshes that the mesh gets if this is the first request for the file
  /// @return index in Scene::meshes of the file's mesh, which load() fills
  uint32_t request_ply(const std::filesystem::path& path, const Place& place, uint32_t slot);

  /// Marks the PLY file of the mesh in this slot as needed; no effect on meshes from other sources.
  void require(uint32_t slot);

  /// Reads all needed files into meshes and images. A mesh that cannot be read stays empty, with one error per shape
  /// that requested it. Throws Error(kCancelled), or MemoryError if the files together exceed the memory budget.
  void load(std::vector<Mesh>& meshes, std::vector<ImageRequest>& images, Progress& progress,
            ImportStatistics& statistics, uint64_t& dropped_triangles);

  /// Hands over the reservation for the memory of the meshes that load() read.
  MemoryReservation take_memory() { return std::move(memory_); }

private:
  struct Report {
    Severity severity;
    uint32_t line;
    std::string message;
  };
  struct Outcome {
    std::vector<Report> reports;
    std::string error; ///< empty on success
    uint64_t bytes = 0;
    uint64_t dropped_triangles = 0;
    MemoryReservation memory; ///< for the data made from the file
  };
  struct PlyUse {
    Place place;
    uint64_t sequence = 0;
  };
  struct PlyFile {
    std::filesystem::path path;
    uint32_t slot = 0;
    bool needed = false;
    std::vector<PlyUse> uses;
    Outcome outcome;
  };

  void read_ply_file(PlyFile& file, Mesh& mesh) const;
  Outcome read_image_file(ImageRequest& image) const;
  void report_ply(const PlyFile& file);
  void report_image(const ImageRequest& image, const Outcome& outcome);

  const ImportOptions& options_;
  Reporter& reporter_;
  std::vector<PlyFile> plys_;
  std::unordered_map<std::string, uint32_t> ply_by_path_;
  std::unordered_map<uint32_t, uint32_t> ply_by_slot_;
  MemoryReservation memory_; ///< for the meshes read
};

} // namespace packtrace
