// Fuzzes Tokenizer and InputFile: every window size gives the same tokens, and runs of numbers equal single tokens
// parsed with std::from_chars. Inputs that start with gzip's magic bytes are inflated first.

#include <bit>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/base/error.h"
#include "pbrt_import/text/tokenizer.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace packtrace::fuzz {
namespace {

constexpr uint64_t kMaxContentBytes = 1u << 20;

struct OwnedToken {
  TokenKind kind;
  std::string text;
  uint32_t line, column;
  bool operator==(const OwnedToken&) const = default;
};

OwnedToken owned(const Token& token) { return {token.kind, std::string(token.text), token.line, token.column}; }

Tokenizer open(const MemoryFile& file, size_t window) {
  return Tokenizer(InputFile(file.path(), kMaxContentBytes), window);
}

/// Returns all tokens including the final end token, or nullopt if the file cannot be read.
std::optional<std::vector<OwnedToken>> tokens_of(const MemoryFile& file, size_t window) {
  std::vector<OwnedToken> tokens;
  try {
    Tokenizer tokenizer = open(file, window);
    uint64_t consumed = 0;
    do {
      tokens.push_back(owned(tokenizer.next()));
      require(tokenizer.consumed_bytes() > consumed || tokens.back().kind == TokenKind::kEnd, "token without bytes");
      consumed = tokenizer.consumed_bytes();
    } while (tokens.back().kind != TokenKind::kEnd);
    require(owned(tokenizer.next()).kind == TokenKind::kEnd, "token after the end");
  } catch (const Error&) {
    return std::nullopt;
  }
  return tokens;
}

/// Whether the whole text parses as `value`.
template <class T>
bool stands_for(std::string_view text, T value) {
  T expected{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), expected);
  if (end != text.data() + text.size()) return false;
  if constexpr (std::is_same_v<T, float>)
    return error == std::errc() && std::bit_cast<uint32_t>(expected) == std::bit_cast<uint32_t>(value);
  else if constexpr (std::is_same_v<T, double>)
    return error == std::errc() && std::bit_cast<uint64_t>(expected) == std::bit_cast<uint64_t>(value);
  else
    return error == std::errc() && expected == value;
}

/// Reads the file alternately as numbers of type T and as single tokens.
template <class T>
void require_same_numbers(const MemoryFile& file, size_t window, const std::vector<OwnedToken>& tokens) {
  Tokenizer tokenizer = open(file, window);
  std::vector<T> run;
  size_t at = 0;
  while (true) {
    run.clear();
    tokenizer.read_numbers<T>([&](auto numbers) { run.insert(run.end(), numbers.begin(), numbers.end()); });
    require(run.size() < tokens.size() - at, "more numbers than tokens");
    for (const T value : run) {
      require(tokens[at].kind == TokenKind::kWord, "number that is no word");
      require(stands_for(tokens[at++].text, value), "number read wrongly");
    }
    require(owned(tokenizer.next()) == tokens[at], "token after a run of numbers");
    if (tokens[at++].kind == TokenKind::kEnd) return;
  }
}

} // namespace
} // namespace packtrace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace packtrace;
  using namespace packtrace::fuzz;
  static const MemoryFile file;
  file.write({reinterpret_cast<const char*>(data), size});
  const auto tokens = tokens_of(file, Tokenizer::kDefaultWindow);
  // The smallest windows overlap most and therefore cost most, so only short inputs use them.
  const size_t least = size < 256 ? 1 : 64;
  for (const size_t window : {least, size_t{64}, size_t{300}, size_t{1000}})
    require(tokens_of(file, window) == tokens, "tokens depend on the window's size");
  if (!tokens) return 0;
  for (const size_t window : {least, size_t{100}, Tokenizer::kDefaultWindow}) {
    require_same_numbers<float>(file, window, *tokens);
    require_same_numbers<double>(file, window, *tokens);
    require_same_numbers<int32_t>(file, window, *tokens);
  }
  bool unknown_escape = false;
  for (const OwnedToken& token : *tokens) {
    require(unescape(token.text, unknown_escape).size() <= token.text.size(), "escapes that grow");
    require(in_quotes(token.text).size() <= 80, "shown text too long");
  }
  return 0;
}
