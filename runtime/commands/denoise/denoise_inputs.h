#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace packtrace {

/// A picture of a sequence.
struct NumberedInput {
  uint64_t number = 0;
  std::string file;
};

/// Lists the pictures that a command line names: one or several files, which are numbered from `start` (0), or one
/// pattern such as in_%04d.exr, whose pictures are those from `start` (the first file there is) to the last file there
/// is, or `frames` of them.
/// Throws Error(kUsage) for several patterns, and options that do not fit; Error(kInput) that names the missing file
/// for a pattern without files, or with a gap.
std::vector<NumberedInput> list_inputs(const std::vector<std::string>& words, std::optional<uint64_t> start,
                                       std::optional<uint64_t> frames);

} // namespace packtrace
