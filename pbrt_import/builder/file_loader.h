#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "pbrt_import/import_scene.h"
#include "pbrt_import/text/reporter.h"
#include "pbrt_import/scene/scene.h"
#include "pbrt_import/language/texture_graph.h"

namespace packtrace {

/// The PLY files that shapes ask for, each read once, all in parallel with the images once the text has been read.
class FileLoader {
public:
  FileLoader(const ImportOptions& options, Reporter& reporter) : options_(options), reporter_(reporter) {}

  /// Asks for a PLY file on behalf of a shape.
  /// @param slot index in Scene::meshes that a first request gets
  /// @return the slot that holds, or will hold, the mesh
  uint32_t request_ply(const std::filesystem::path& path, const Place& place, uint32_t slot);

  /// Marks what slot's mesh came from as needed; no effect on other meshes.
  void require(uint32_t slot);

  /// Reads all files that are needed into meshes and images. A mesh that cannot be read stays empty and is reported
  /// for each shape that asked for it. Throws Error(kCancelled), and MemoryError where there is not enough for all.
  void load(std::vector<Mesh>& meshes, std::vector<ImageRequest>& images, Progress& progress,
            ImportStatistics& statistics, uint64_t& dropped_triangles);

  /// What the meshes take that load() read.
  MemoryReservation take_memory() { return std::move(memory_); }

private:
  struct Report {
    Severity severity;
    uint32_t line;
    std::string message;
  };
  struct Outcome {
    std::vector<Report> reports;
    std::string error; ///< empty: all is well
    uint64_t bytes = 0;
    uint64_t dropped_triangles = 0;
    MemoryReservation memory; ///< for what was made of the file
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
  MemoryReservation memory_; ///< of meshes
};

} // namespace packtrace
