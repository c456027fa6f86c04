#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace packtrace {

enum class Severity : uint8_t { kNote, kWarning, kError };
std::string_view to_string(Severity severity);

struct SourceFile;

/// A position in a source file. Lines and columns count from 1; 0 means "the file as a whole".
struct SourceLocation {
  std::shared_ptr<const SourceFile> file; ///< null: no file
  uint32_t line = 0;
  uint32_t column = 0;
};

/// An opened source file and, if it was included, the position of the Include directive.
struct SourceFile {
  std::string path;
  SourceLocation included_from;
};

/// The location as "file:line:column", without the parts that are 0; empty without a file.
std::string to_string(const SourceLocation& location);

/// A problem found in the input.
struct Diagnostic {
  Severity severity = Severity::kNote;
  SourceLocation location; ///< of the first occurrence
  std::string message;
  uint64_t count = 1; ///< number of reports of this message for this file
};

/// The diagnostic as "file:line:column: error: message (N times, first here)", followed by one "  included from ..."
/// line per Include; the middle of a long chain is left out.
std::string to_string(const Diagnostic& diagnostic);

/// Collects problems that do not stop the work. Thread-safe; entries() is ordered by a sequence number of the caller
/// (the order of the source text), so that it does not depend on the number of threads.
class Diagnostics {
public:
  /// Adds a problem, or counts it if the same message was reported for the same file before.
  /// @param sequence orders the entries; entries with equal numbers are ordered by line and column, then by severity,
  ///   file and message
  void report(Severity severity, SourceLocation location, std::string message, uint64_t sequence = 0);

  /// All problems in order of their sequence numbers, each with the location of its first occurrence.
  std::vector<Diagnostic> entries() const;

  /// Number of occurrences (not distinct messages) at this severity.
  uint64_t count(Severity severity) const;

private:
  struct Entry {
    Diagnostic diagnostic;
    uint64_t sequence = 0;
  };
  mutable std::mutex mutex_;
  std::map<std::tuple<Severity, std::string, std::string>, Entry> entries_; // by (severity, file path, message)
};

} // namespace packtrace
