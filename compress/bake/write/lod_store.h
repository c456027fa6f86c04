#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "compress/bake/lod/lod_encoder.h"
#include "compress/bake/write/stored_lod_check.h"

namespace packtrace {

/// Identifies the input of a LOD build: XXH3-128 of a geometry on its lattice, its clusters and the limits.
using LodKey = std::array<uint64_t, 2>;
/// @param limits as passed to build_cluster_lod()
LodKey lod_key(const QuantizedGeometry& geometry, const GeometryClusters& base, const LodLimits& limits);

/// Stores finished LOD levels, one file per geometry, so that an interrupted bake can resume. Files are valid for one
/// program version and one machine; files of other versions and damaged files are ignored. Hashes alone are not
/// trusted: contents are checked like any input file. All functions but clear() may be called concurrently.
class LodStore {
public:
  /// Creates the folder if it is missing. Throws Error(kIo) on failure.
  explicit LodStore(std::filesystem::path folder);

  /// Returns the stored levels if they can be read and are valid.
  /// @param base the geometry that the key belongs to
  std::optional<EncodedLod> find(const LodKey& key, const LodBase& base) const;
  /// Writes the file atomically. Throws Error(kIo).
  void keep(const LodKey& key, const EncodedLod& lod) const;
  /// Removes all files of the store, and the folder if it is empty then. Continues after failures; throws Error(kIo)
  /// that names the first file left and the number of others.
  void clear() const;

private:
  std::filesystem::path path_of(const LodKey& key) const;

  std::filesystem::path folder_;
};

} // namespace packtrace
