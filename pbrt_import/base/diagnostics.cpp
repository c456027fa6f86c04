#include "pbrt_import/base/diagnostics.h"

#include <algorithm>
#include <utility>

namespace packtrace {

std::string_view to_string(Severity severity) {
  switch (severity) {
  case Severity::kNote:
    return "note";
  case Severity::kWarning:
    return "warning";
  case Severity::kError:
    return "error";
  }
  return "unknown";
}

std::string to_string(const SourceLocation& location) {
  if (!location.file) return {};
  std::string text = location.file->path;
  // append() instead of ":" + ..., because GCC 12 issues a false -Wrestrict warning for the latter.
  if (location.line > 0) text.append(":").append(std::to_string(location.line));
  if (location.line > 0 && location.column > 0) text.append(":").append(std::to_string(location.column));
  return text;
}

std::string to_string(const Diagnostic& diagnostic) {
  std::string text = to_string(diagnostic.location);
  if (!text.empty()) text += ": ";
  text += std::string(to_string(diagnostic.severity)) + ": " + diagnostic.message;
  if (diagnostic.count > 1) text += " (" + std::to_string(diagnostic.count) + " times, first here)";
  // The ends of a long chain are the most useful: the files around the problem and the main file.
  constexpr size_t kShownAtEachEnd = 4;
  std::vector<const SourceLocation*> chain;
  for (const SourceFile* file = diagnostic.location.file.get(); file && file->included_from.file;
       file = file->included_from.file.get())
    chain.push_back(&file->included_from);
  const size_t hidden = chain.size() > 2 * kShownAtEachEnd + 1 ? chain.size() - 2 * kShownAtEachEnd : 0;
  for (size_t i = 0; i < chain.size(); ++i) {
    if (hidden > 0 && i == kShownAtEachEnd) {
      text += "\n  ... and through " + std::to_string(hidden) + " more files";
      i += hidden;
    }
    text += "\n  included from " + to_string(*chain[i]);
  }
  return text;
}

void Diagnostics::report(Severity severity, SourceLocation location, std::string message, uint64_t sequence) {
  const std::lock_guard lock(mutex_);
  std::string path = location.file ? location.file->path : std::string();
  auto [it, inserted] = entries_.try_emplace({severity, std::move(path), message});
  Entry& entry = it->second;
  const auto place = [](uint64_t seq, const SourceLocation& at) { return std::tuple(seq, at.line, at.column); };
  if (inserted) {
    entry = {{severity, std::move(location), std::move(message), 1}, sequence};
    return;
  }
  ++entry.diagnostic.count;
  if (place(sequence, location) < place(entry.sequence, entry.diagnostic.location)) {
    entry.sequence = sequence;
    entry.diagnostic.location = std::move(location);
  }
}

std::vector<Diagnostic> Diagnostics::entries() const {
  const std::lock_guard lock(mutex_);
  std::vector<const Entry*> ordered;
  ordered.reserve(entries_.size());
  for (const auto& [key, entry] : entries_) ordered.push_back(&entry);
  const auto key = [](const Entry* entry) {
    const SourceLocation& at = entry->diagnostic.location;
    return std::tuple(entry->sequence, at.line, at.column);
  };
  std::stable_sort(ordered.begin(), ordered.end(), [&](const Entry* a, const Entry* b) { return key(a) < key(b); });
  std::vector<Diagnostic> result;
  result.reserve(ordered.size());
  for (const Entry* entry : ordered) result.push_back(entry->diagnostic);
  return result;
}

uint64_t Diagnostics::count(Severity severity) const {
  const std::lock_guard lock(mutex_);
  uint64_t total = 0;
  for (const auto& [key, entry] : entries_)
    if (std::get<0>(key) == severity) total += entry.diagnostic.count;
  return total;
}

} // namespace packtrace
