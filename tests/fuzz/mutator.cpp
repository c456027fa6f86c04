#include "tests/fuzz/mutator.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <stdexcept>

namespace packtrace::fuzz {
namespace {

/// Returns the characters between the quotes of a dictionary line, unescaped.
std::string unescaped(std::string_view text, size_t line) {
  std::string word;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\\') {
      word += text[i];
    } else if (i + 1 < text.size() && (text[i + 1] == '\\' || text[i + 1] == '"')) {
      word += text[++i];
    } else {
      uint8_t byte = 0;
      const char* const digits = text.data() + i + 2;
      if (i + 4 > text.size() || text[i + 1] != 'x' || std::from_chars(digits, digits + 2, byte, 16).ptr != digits + 2)
        throw std::runtime_error("dictionary line " + std::to_string(line) + ": unknown escape");
      word += static_cast<char>(byte);
      i += 3;
    }
  }
  return word;
}

} // namespace

std::vector<std::string> parse_dictionary(std::string_view text) {
  std::vector<std::string> words;
  for (size_t line = 1; !text.empty(); ++line) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string_view content = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (content.empty() || content[0] == '#') continue;
    const size_t open = content.find('"'), close = content.rfind('"');
    if (open == std::string_view::npos || close == open)
      throw std::runtime_error("dictionary line " + std::to_string(line) + ": expected name=\"text\"");
    words.push_back(unescaped(content.substr(open + 1, close - open - 1), line));
  }
  return words;
}

Mutator::Mutator(std::vector<std::string> corpus, std::vector<std::string> dictionary, uint64_t seed, size_t max_bytes)
    : corpus_(std::move(corpus)), dictionary_(std::move(dictionary)), random_(seed), max_bytes_(max_bytes) {}

std::string Mutator::next() {
  std::string input = corpus_[below(corpus_.size())];
  for (size_t changes = 1 + below(8); changes > 0; --changes) change(input);
  if (input.size() > max_bytes_) input.resize(max_bytes_);
  return input;
}

void Mutator::change(std::string& input) {
  if (input.empty()) return insert_word(input);
  const size_t at = below(input.size()), length = 1 + below(std::min<size_t>(input.size() - at, 64));
  switch (below(9)) {
  case 0:
    input[at] = static_cast<char>(input[at] ^ (1 << below(8)));
    break;
  case 1:
    input[at] = static_cast<char>(below(256));
    break;
  case 2:
    input.erase(at, length);
    break;
  case 3:
    input.insert(below(input.size()), input.substr(at, length));
    break;
  case 4:
    input.resize(at);
    break;
  case 5:
    overwrite_with_extreme(input);
    break;
  case 6:
    replace_number(input);
    break;
  case 7:
    insert_word(input);
    break;
  default:
    splice(input);
  }
}

void Mutator::overwrite_with_extreme(std::string& input) {
  constexpr uint64_t kExtremes[] = {0,          1,          0x7f,       0x80,       0xff,
                                    0x7fff,     0x8000,     0xffff,     0x7fffffff, 0x80000000,
                                    0xffffffff, 0x7f800000, 0x7fc00000, 0x00000001, 0x7fffffffffffffff};
  uint64_t value = kExtremes[below(std::size(kExtremes))];
  const size_t width = size_t{1} << below(4);
  if (input.size() < width) return;
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  if (below(2) == 1) std::reverse(bytes, bytes + width);
  std::copy_n(bytes, width, input.begin() + static_cast<std::ptrdiff_t>(below(input.size() - width + 1)));
}

void Mutator::replace_number(std::string& input) {
  constexpr std::string_view kNumbers[] = {
      "0",          "-0",          "1",          "-1",   "2",    "3",        "64",    "255",   "256",
      "2147483647", "-2147483648", "4294967295", "1e38", "1e39", "1e-38",    "1e-46", "1e308", "1e400",
      "nan",        "inf",         "-inf",       "0.5",  "1e-7", "16777217", "1e6",   "360",   "18446744073709551616"};
  constexpr std::string_view kDigits = "0123456789.+-eE";
  const size_t start = input.find_first_of("0123456789", below(input.size()));
  if (start == std::string::npos) return;
  const size_t end = std::min(input.find_first_not_of(kDigits, start), input.size());
  input.replace(start, end - start, kNumbers[below(std::size(kNumbers))]);
}

void Mutator::insert_word(std::string& input) {
  if (dictionary_.empty()) return;
  const std::string& word = dictionary_[below(dictionary_.size())];
  const size_t at = below(input.size() + 1);
  if (below(2) == 0)
    input.insert(at, word);
  else
    input.replace(at, word.size(), word);
}

void Mutator::splice(std::string& input) {
  const std::string& other = corpus_[below(corpus_.size())];
  const size_t from = below(other.size());
  const std::string part = other.substr(from, 1 + below(std::min<size_t>(other.size() - from, 1024)));
  input.replace(below(input.size()), below(part.size()), part);
}

} // namespace packtrace::fuzz
