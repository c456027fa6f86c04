#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "pbrt_import/text/number.h"
#include "pbrt_import/text/plain_text.h"
#include "pbrt_import/text/text_blocks.h"

namespace packtrace {

enum class TokenKind : uint8_t {
  kWord,               ///< a directive or a number
  kString,             ///< text: the characters between the quotes, escapes not replaced
  kOpen,               ///< [
  kClose,              ///< ]
  kUnterminatedString, ///< text: the rest of the line
  kBadByte,            ///< text: a byte that is invalid in pbrt files; in a string, the first such byte
  kTooLong,            ///< a word or string longer than kMaxTokenBytes; no text
  kEnd,                ///< end of the file, returned again by every further call
};

/// Longer than any name, number or path.
inline constexpr size_t kMaxTokenBytes = size_t{2} << 20;

struct Token {
  TokenKind kind = TokenKind::kEnd;
  std::string_view text; ///< valid until the next call of the tokenizer
  uint32_t line = 0;     ///< of the first character, from 1
  uint32_t column = 0;   ///< in bytes, from 1
};

/// Numbers of one type, or integers; the other span is empty.
template <class T>
struct NumberSpans {
  std::span<const T> own;
  std::span<const int32_t> integers;
  size_t size() const { return own.size() + integers.size(); }
};

/// Splits a pbrt-v3 file into tokens in one pass over a window of its text, which is a block, or a copy of several
/// blocks if a token spans them. Lines end with LF, CR LF or CR; a UTF-8 byte order mark is skipped.
class Tokenizer {
public:
  static constexpr size_t kDefaultWindow = 128 * 1024;

  /// Throws Error like InputFile::read, and Error(kInput) for UTF-16.
  explicit Tokenizer(InputFile file, size_t window_bytes = kDefaultWindow);

  /// Returns the next token. Throws Error like InputFile::read.
  Token next();

  /// Calls take(std::span<const T>) with the numbers that follow in the file and were converted ahead; there may be
  /// none, and they never extend beyond the end of their array. T is float, double or int32_t; for any T, take may also
  /// get a span of int32_t. Throws Error like InputFile::read.
  template <class T, class Take>
  void read_numbers(Take take);

  /// Reads the next word if it is a number in the common form, far from the window's end and behind nothing but spaces
  /// and line feeds; else reads nothing. The value is that of parse_number() for the word. T is float or double.
  template <class T>
  bool read_bare_number(T& value);

  /// The text from the current position, to be read ahead of the tokenizer; none while a long token is joined.
  PlainText plain_text() const {
    if (window_ != block_->text.data()) return {};
    return {window_, size_, position_, window_offset_, line_, line_start_};
  }
  /// Moves past all that was read from plain_text(). There must have been no other call since.
  void accept(const PlainText& text) {
    position_ = static_cast<size_t>(text.offset() - window_offset_);
    line_ = text.line();
    line_start_ = text.line_start();
  }
  /// Reads the numbers of an array that were converted ahead, if they all were, are of type T and "]" follows them.
  /// @param text at the position after "[", behind what plain_text() returned; moves past the "]"
  /// @return all the numbers: of type T, or of int32_t; both empty if the array has another form
  template <class T>
  NumberSpans<T> take_array(PlainText& text);

  /// Content bytes consumed so far.
  uint64_t consumed_bytes() const { return window_offset_ + position_; }
  const InputFile& file() const { return blocks_->file(); }

private:
  /// Extends the window beyond its current end; false at the end of the file.
  bool refill();
  void show(const TextBlock& block);
  /// The run of numbers that starts at the current position and is convertible to T; null if there is none.
  template <class T>
  const NumberRun* find_run();
  /// The run that starts at an offset, in the last block.
  template <class T>
  const NumberRun* find_run_at(uint64_t offset);
  void skip(const NumberRun& run);
  bool skip_space_and_comments();
  void skip_comment();
  void count_line_end(size_t at);
  Token read_string();
  Token read_word();
  /// Skips the first `length` bytes of a token that exceeds kMaxTokenBytes, and sets length to 0.
  void cut(size_t& length);
  Token make(TokenKind kind, size_t start, size_t end) const;
  void check_encoding();

  std::unique_ptr<TextBlocks> blocks_;
  const TextBlock* block_ = nullptr; ///< the block read last
  size_t run_ = 0;                   ///< index into block_->runs; earlier runs start before the current position
  std::vector<char> joined_;         ///< copy of several blocks, if the window is not block_'s text
  const char* window_ = nullptr;     ///< size_ bytes followed by kScannerReach zeros
  size_t size_ = 0;
  size_t position_ = 0;
  uint64_t window_offset_ = 0; ///< offset of window_[0] in the content
  bool at_end_ = false;        ///< the file ends with the window
  uint32_t line_ = 1;
  uint64_t line_start_ = 0; ///< offset of the line's first byte in the content
  uint32_t token_line_ = 1;
  uint32_t token_column_ = 1;
};

/// Value of a string token: \b \f \n \r \t \\ \' \" are replaced, other backslashes are kept.
/// @param unknown_escape set to true if a backslash was kept
std::string unescape(std::string_view raw, bool& unknown_escape);

/// Text in double quotes for messages: bytes that are not printable() are shown as \xNN; cut after max_length bytes.
inline constexpr size_t kMaxShownPath = 4096;
std::string in_quotes(std::string_view text, size_t max_length = 60);

template <class T, class Take>
void Tokenizer::read_numbers(Take take) {
  while (const NumberRun* const run = find_run<T>()) {
    using Kind = NumberRun::Kind;
    const auto part = [&](const auto& numbers) { return std::span(numbers).subspan(run->first, run->count); };
    if (run->kind == Kind::kInteger)
      take(part(block_->integers));
    else if constexpr (std::is_same_v<T, float>)
      take(part(block_->floats));
    else if constexpr (std::is_same_v<T, double>)
      take(part(block_->doubles));
    skip(*run);
  }
}

template <class T>
bool Tokenizer::read_bare_number(T& value) {
  size_t start = position_, line_end = 0;
  uint32_t line_ends = 0;
  for (; start < size_ && (window_[start] == ' ' || window_[start] == '\n'); ++start)
    if (window_[start] == '\n') ++line_ends, line_end = start;
  if (start + kScannerReach > size_) return false;
  const char* end = nullptr;
  if constexpr (std::is_same_v<T, float>)
    end = scan_float(window_ + start, value);
  else
    end = scan_double(window_ + start, value);
  if (!end) return false;
  position_ = static_cast<size_t>(end - window_);
  line_ += line_ends;
  if (line_ends > 0) line_start_ = window_offset_ + line_end + 1;
  return true;
}

template <class T>
NumberSpans<T> Tokenizer::take_array(PlainText& text) {
  using Kind = NumberRun::Kind;
  const NumberRun* const run = find_run_at<T>(text.offset());
  if (!run || run->end >= window_offset_ + size_) return {};
  PlainText after = text;
  after.move_to(run->end, text.line() + run->line_ends, run->line_ends > 0 ? run->line_start : text.line_start());
  if (!after.take(']')) return {};
  text = after;
  const auto part = [&](const auto& numbers) { return std::span(numbers).subspan(run->first, run->count); };
  if (run->kind == Kind::kInteger) return {{}, part(block_->integers)};
  if constexpr (std::is_same_v<T, float>) return {part(block_->floats), {}};
  if constexpr (std::is_same_v<T, double>) return {part(block_->doubles), {}};
  return {};
}

template <class T>
const NumberRun* Tokenizer::find_run() {
  const uint64_t offset = consumed_bytes();
  if (offset >= block_->offset + blocks_->block_bytes() && !refill()) return nullptr;
  return find_run_at<T>(offset);
}

template <class T>
const NumberRun* Tokenizer::find_run_at(uint64_t offset) {
  while (run_ < block_->runs.size() && block_->runs[run_].begin < offset) ++run_;
  if (run_ == block_->runs.size() || block_->runs[run_].begin != offset) return nullptr;
  const NumberRun& run = block_->runs[run_];
  constexpr NumberRun::Kind kKind = std::is_same_v<T, int32_t> ? NumberRun::Kind::kInteger
                                    : std::is_same_v<T, float> ? NumberRun::Kind::kFloat
                                                               : NumberRun::Kind::kDouble;
  return run.kind == kKind || run.kind == NumberRun::Kind::kInteger ? &run : nullptr;
}

} // namespace packtrace
