#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace packtrace {

/// The names of a sequence's files: a path whose file name has one number, written %d or %0Nd as for printf. %% is a
/// percent sign.
class FramePattern {
public:
  /// Throws Error(kUsage) unless the file name has exactly one such directive, with N in 1..18, and nothing before it
  /// in the path has one.
  explicit FramePattern(const std::string& pattern);

  const std::string& text() const { return text_; }

  /// File of a frame. Needs number >= 0.
  std::filesystem::path file(int64_t number) const;

  /// Number of the frame with this file name, without folders; nullopt if there is none.
  std::optional<int64_t> number_of(const std::string& file_name) const;

  /// The same files below a folder; an absolute pattern stays.
  FramePattern below(const std::filesystem::path& folder) const;

  std::filesystem::path folder() const { return folder_; }

private:
  std::string text_;
  std::filesystem::path folder_;
  std::string before_, after_; ///< of the number, in the file name
  size_t digits_ = 1;          ///< at least that many
};

} // namespace packtrace
