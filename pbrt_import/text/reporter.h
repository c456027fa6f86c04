#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "pbrt_import/language/parameters.h"
#include "pbrt_import/base/diagnostics.h"

namespace packtrace {

/// All files opened by one import, in order of opening.
class SourceFiles {
public:
  /// Adds a file; its number is what Place::file holds.
  /// @param included_from nothing for the main file
  uint32_t add(const std::string& path, std::optional<Place> included_from);
  SourceLocation locate(const Place& place) const;
  size_t size() const { return files_.size(); }

private:
  struct File {
    uint32_t path = 0; ///< into paths_
    Place included_from;
  };
  std::shared_ptr<const SourceFile> source_file(uint32_t file) const;

  static constexpr uint32_t kMainFile = ~0u; ///< File::included_from.file of one that nothing includes
  std::vector<File> files_; ///< there may be many, of few names
  std::vector<std::string> paths_;
  std::unordered_map<std::string, uint32_t> path_numbers_;
  mutable std::unordered_map<uint32_t, std::shared_ptr<const SourceFile>> located_; ///< those that something is said of
};

/// Reports problems in the order of the source text, to one thread's Diagnostics. A file that holds nothing but
/// mistakes cannot fill the memory with messages: beyond kMaxDistinct they are only counted.
class Reporter {
public:
  static constexpr size_t kMaxDistinct = 10'000;

  Reporter(const SourceFiles& files, Diagnostics& diagnostics) : files_(files), diagnostics_(diagnostics) {}

  /// Later reports belong to the next directive.
  void next_directive() { ++sequence_; }
  uint64_t sequence() const { return sequence_; }
  /// For problems found after parsing in what an earlier directive asked for.
  void set_sequence(uint64_t sequence) { sequence_ = sequence; }

  void report(Severity severity, const Place& place, std::string message);
  void report(Severity severity, SourceLocation location, std::string message);
  void error(const Place& place, std::string message) { report(Severity::kError, place, std::move(message)); }
  void warning(const Place& place, std::string message) { report(Severity::kWarning, place, std::move(message)); }
  void note(const Place& place, std::string message) { report(Severity::kNote, place, std::move(message)); }

  /// Reports how many problems were not listed, if any.
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

/// Reports what nobody asked for, with the name it might have been meant to be.
void report_unused(const ParameterList& parameters, Reporter& reporter);

} // namespace packtrace
