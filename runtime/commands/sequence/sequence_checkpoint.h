#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace packtrace {

/// The state of a sequence after some of its pictures.
struct SequenceState {
  uint64_t pictures = 0;        ///< number of finished pictures
  std::vector<std::byte> frame; ///< FrameLoop::save()
};

/// The file from which an interrupted sequence is resumed. It is written periodically and removed at the end.
class SequenceCheckpoint {
public:
  /// @param settings text that describes everything on which the pictures depend
  SequenceCheckpoint(std::string file, std::string settings) : file_(std::move(file)), settings_(std::move(settings)) {}

  const std::string& file() const { return file_; }

  /// Writes the state. Throws like OutputFile.
  void save(const SequenceState& state) const;

  /// Reads the last state; none if there is no file. Throws Error(kInput) for a damaged file, Error(kUsage) for one of
  /// other settings.
  std::optional<SequenceState> load() const;

  /// Removes the file if there is one.
  void remove() const;

private:
  std::string file_, settings_;
};

} // namespace packtrace
