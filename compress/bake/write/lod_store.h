#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "compress/bake/lod/lod_encoder.h"
#include "compress/bake/write/stored_lod_check.h"

namespace packtrace {

/// What levels of detail follow from: XXH3-128 of a geometry on its lattice, its clusters and the limits of its levels.
using LodKey = std::array<uint64_t, 2>;
/// @param limits as build_cluster_lod() takes them
LodKey lod_key(const QuantizedGeometry& geometry, const GeometryClusters& base, const LodLimits& limits);

/// Levels of detail that are finished, one file for each geometry, so that an interrupted bake can go on with them. For
/// one program and one machine: files of other versions, and damaged ones, are as if they were not there. Their hashes
/// are no proof: what is read is checked as any file is. Every function but clear() may run on several threads.
class LodStore {
public:
  /// Makes the folder if it is missing. Throws Error(kIo) where that fails.
  explicit LodStore(std::filesystem::path folder);

  /// What was kept, if it can be read and is fit for a file.
  /// @param base the geometry that the key is of
  std::optional<EncodedLod> find(const LodKey& key, const LodBase& base) const;
  /// The file appears whole or not at all. Throws Error(kIo).
  void keep(const LodKey& key, const EncodedLod& lod) const;
  /// Removes all such files, and the folder if nothing else is in it. Throws Error(kIo) that names the first file that
  /// stays and how many there are; the others are removed.
  void clear() const;

private:
  std::filesystem::path path_of(const LodKey& key) const;

  std::filesystem::path folder_;
};

} // namespace packtrace
