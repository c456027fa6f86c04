#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace packtrace::fuzz {

/// Returns the words of a dictionary in libFuzzer's notation: lines `name="text"` with \xNN, \\ and \", and # comments.
/// Throws std::runtime_error, with the line number, for any other line.
std::vector<std::string> parse_dictionary(std::string_view text);

/// Generates inputs from a corpus. The sequence depends on the arguments only.
class Mutator {
public:
  /// @param corpus not empty
  Mutator(std::vector<std::string> corpus, std::vector<std::string> dictionary, uint64_t seed, size_t max_bytes);

  /// Returns a corpus input with one to eight random changes: bits, bytes, binary and decimal extremes, dictionary
  /// words, parts removed, doubled or taken from another input. At most max_bytes long.
  std::string next();

private:
  size_t below(size_t bound) { return bound == 0 ? 0 : static_cast<size_t>(random_() % bound); }
  void change(std::string& input);
  void overwrite_with_extreme(std::string& input);
  void replace_number(std::string& input);
  void insert_word(std::string& input);
  void splice(std::string& input);

  std::vector<std::string> corpus_;
  std::vector<std::string> dictionary_;
  std::mt19937_64 random_;
  size_t max_bytes_;
};

} // namespace packtrace::fuzz
