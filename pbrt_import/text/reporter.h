#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/language/parameters.h"

namespace packtrace {

/// All files that an import opened, in order of opening.
class SourceFiles {
public:
  /// Adds a file and returns its number for Place::file.
  /// @param included_from position of the Include; unset for the main file
  uint32_t add(const std::string& path, std::optional<Place> included_from);
  SourceLocation locate(const Place& place) const;
  size_t size() const { return files_.size(); }

private:
  struct File {
    uint32_t path = 0; ///< index into paths_
    Place included_from;
  };
  std::shared_ptr<const SourceFile> source_file(uint32_t file) const;

  static constexpr uint32_t kMainFile = ~0u; ///< File::included_from.file of the main file
  std::vector<File> files_;                  ///< one per opening; there may be many openings of few paths
  std::vector<std::string> paths_;
  std::unordered_map<std::string, uint32_t> path_numbers_;
  /// Cache of files that reports refer to.
  mutable std::unordered_map<uint32_t, std::shared_ptr<const SourceFile>> located_;
};

/// Passes problems to the Diagnostics of one thread, in the order of the source text. Beyond kMaxDistinct different
/// problems they are only counted, so that a file full of mistakes cannot fill the memory with messages.
class Reporter {
public:
  static constexpr size_t kMaxDistinct = 10'000;

  Reporter(const SourceFiles& files, Diagnostics& diagnostics) : files_(files), diagnostics_(diagnostics) {}

  /// Assigns later reports to the next directive.
  void next_directive() { ++sequence_; }
  uint64_t sequence() const { return sequence_; }
  /// Assigns later reports to an earlier directive, for problems that are found after parsing.
  void set_sequence(uint64_t sequence) { sequence_ = sequence; }

  void report(Severity severity, const Place& place, std::string message);
  void report(Severity severity, SourceLocation location, std::string message);
  void error(const Place& place, std::string message) { report(Severity::kError, place, std::move(message)); }
  void warning(const Place& place, std::string message) { report(Severity::kWarning, place, std::move(message)); }
  void note(const Place& place, std::string message) { report(Severity::kNote, place, std::move(message)); }

  /// Reports the number of unlisted problems, if any.
  void finish();

  SourceLocation locate(const Place& place) const { return files_.locate(place); }

private:
  const SourceFiles& files_;
  Diagnostics& diagnostics_;
  std::unordered_set<uint64_t> seen_; ///< hashes of (severity, path, message)
  uint64_t sequence_ = 0;
  uint64_t unlisted_ = 0;
  Severity worst_unlisted_ = Severity::kNote;
};

/// Reports parameters that were never used, with a similar name that was looked up, if any.
void report_unused(const ParameterList& parameters, Reporter& reporter);

} // namespace packtrace
