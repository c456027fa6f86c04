#include "runtime/commands/denoise/denoise_inputs.h"

#include <algorithm>
#include <set>
#include <system_error>

#include <fmt/format.h>

#include "pbrt_import/base/file_error.h"
#include "runtime/commands/sequence/sequence_names.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;

bool is_pattern(const std::string& word) {
  std::error_code error; // of a name that cannot be a file
  return word.find('%') != std::string::npos && !fs::exists(word, error);
}

/// Numbers of the files that there are.
std::set<uint64_t> numbers_of(const NumberedName& name) {
  std::set<uint64_t> numbers;
  const fs::path folder = fs::path(name.pattern()).parent_path();
  std::error_code error; // of a folder that does not exist: it has no files
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error))
    if (const auto number = name.number_of((folder / entry.path().filename()).string())) numbers.insert(*number);
  return numbers;
}

std::vector<NumberedInput> numbered_inputs(const NumberedName& name, std::optional<uint64_t> start,
                                           std::optional<uint64_t> frames) {
  const std::set<uint64_t> there = numbers_of(name);
  if (there.empty() && !start)
    throw FileError(ErrorKind::kInput, name.pattern(), "there is no file with a number in this place");
  const uint64_t first = start.value_or(there.empty() ? 0 : *there.begin());
  const uint64_t count = frames.value_or(there.empty() || *there.rbegin() < first ? 1 : *there.rbegin() - first + 1);
  std::vector<NumberedInput> inputs;
  for (uint64_t number = first; number - first < count; ++number) {
    std::string file = name.at(number);
    if (!there.contains(number)) {
      const auto next = there.upper_bound(number);
      throw FileError(ErrorKind::kInput, file,
                      next == there.end()
                          ? std::string("this picture of the sequence is missing")
                          : fmt::format("this picture of the sequence is missing, but there is {}", name.at(*next)));
    }
    inputs.push_back({number, std::move(file)});
  }
  return inputs;
}

} // namespace

std::vector<NumberedInput> list_inputs(const std::vector<std::string>& words, std::optional<uint64_t> start,
                                       std::optional<uint64_t> frames) {
  if (frames && (*frames < 1 || *frames > kMaxPictures))
    throw Error(ErrorKind::kUsage, fmt::format("--frames must be in [1, {}]", kMaxPictures));
  const auto pattern = std::ranges::find_if(words, is_pattern);
  if (pattern != words.end()) {
    if (words.size() > 1) throw Error(ErrorKind::kUsage, *pattern + ": a numbered sequence must be the only input");
    return numbered_inputs(NumberedName(*pattern), start, frames);
  }
  if (frames && *frames != words.size())
    throw Error(ErrorKind::kUsage, fmt::format("--frames {} does not fit {} input file{}; it counts the pictures of a "
                                               "numbered sequence such as in_%04d.exr",
                                               *frames, words.size(), words.size() == 1 ? "" : "s"));
  std::vector<NumberedInput> inputs;
  for (size_t i = 0; i < words.size(); ++i) inputs.push_back({start.value_or(0) + i, words[i]});
  return inputs;
}

} // namespace packtrace
