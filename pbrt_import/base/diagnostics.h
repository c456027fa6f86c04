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

/// A place in a source file. Lines and columns count from 1; 0 means "the file as a whole".
struct SourceLocation {
  std::shared_ptr<const SourceFile> file; ///< null: no file is to blame
  uint32_t line = 0;
  uint32_t column = 0;
};

/// One opened source file and, where it was included, the place of the Include directive.
struct SourceFile {
  std::string path;
  SourceLocation included_from;
};

/// "file:line:column", shortened by the parts that are 0; empty where there is no file.
std::string to_string(const SourceLocation& location);

/// One problem found in the input.
struct Diagnostic {
  Severity severity = Severity::kNote;
  SourceLocation location; ///< of the first occurrence
  std::string message;
  uint64_t count = 1; ///< how many times this message was reported for this file
};

/// "file:line:column: error: message (N times)" followed by one "  included from ..." line per include.
std::string to_string(const Diagnostic& diagnostic);

/// Collects problems that do not stop the work. Reports from several threads are allowed; entries() is ordered
/// by a sequence number the caller gives (the order of the source text), so it is the same for any thread count.
class Diagnostics {
public:
  /// Adds a problem, or counts it where the same message was reported for the same file before.
  /// @param sequence orders entries; entries with equal numbers keep (file, line, column, message) order
  void report(Severity severity, SourceLocation location, std::string message, uint64_t sequence = 0);

  /// All problems, first occurrences in order of sequence. Not to be called while others report.
  std::vector<Diagnostic> entries() const;

  /// Occurrences (not distinct messages) at this severity.
  uint64_t count(Severity severity) const;

private:
  struct Entry {
    Diagnostic diagnostic;
    uint64_t sequence = 0;
  };
  mutable std::mutex mutex_;
  std::map<std::tuple<Severity, std::string, std::string>, Entry> entries_; // (severity, file path, message)
};

} // namespace packtrace
