#include "pbrt_import/text/reporter.h"

#include <algorithm>
#include <utility>

#include "pbrt_import/text/tokenizer.h"

namespace packtrace {

uint32_t SourceFiles::add(const std::string& path, std::optional<Place> included_from) {
  const auto [number, inserted] = path_numbers_.try_emplace(path, static_cast<uint32_t>(paths_.size()));
  if (inserted) paths_.push_back(path);
  files_.push_back({number->second, included_from.value_or(Place{kMainFile, 0, 0})});
  return static_cast<uint32_t>(files_.size() - 1);
}

std::shared_ptr<const SourceFile> SourceFiles::source_file(uint32_t file) const {
  if (const auto found = located_.find(file); found != located_.end()) return found->second;
  const File& f = files_[file];
  // The recursion is as deep as the Include chain, which is limited.
  auto made = std::make_shared<const SourceFile>(SourceFile{paths_[f.path], locate(f.included_from)});
  located_.emplace(file, made);
  return made;
}

SourceLocation SourceFiles::locate(const Place& place) const {
  if (place.file >= files_.size()) return {};
  return {source_file(place.file), place.line, place.column};
}

void Reporter::report(Severity severity, const Place& place, std::string message) {
  report(severity, locate(place), std::move(message));
}

void Reporter::report(Severity severity, SourceLocation location, std::string message) {
  const std::string_view path = location.file ? std::string_view(location.file->path) : std::string_view();
  uint64_t hash = std::hash<std::string_view>{}(message);
  hash = hash * 0x9E3779B97F4A7C15u + std::hash<std::string_view>{}(path) + static_cast<uint64_t>(severity);
  if (!seen_.contains(hash)) {
    if (seen_.size() >= kMaxDistinct) {
      ++unlisted_;
      worst_unlisted_ = std::max(worst_unlisted_, severity);
      return;
    }
    seen_.insert(hash);
  }
  diagnostics_.report(severity, std::move(location), std::move(message), sequence_);
}

void Reporter::finish() {
  if (unlisted_ == 0) return;
  diagnostics_.report(worst_unlisted_, {},
                      std::to_string(unlisted_) + " further problems are not listed: only the first " +
                          std::to_string(kMaxDistinct) + " different ones are",
                      UINT64_MAX);
  unlisted_ = 0;
}

void report_unused(const ParameterList& parameters, Reporter& reporter) {
  for (const Parameter& parameter : parameters.all()) {
    if (parameter.used) continue;
    std::string message = "parameter " + describe(parameter) + " is ";
    if (parameters.was_looked_up(parameter.name))
      message += "ignored: it has the wrong type or number of values here";
    else
      message += "not used" + did_you_mean(parameters.suggestion(parameter.name));
    reporter.warning(parameter.place, std::move(message));
  }
}

} // namespace packtrace
