#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "pbrt_import/text/number.h"
#include "pbrt_import/text/scan_tokens.h"

namespace packtrace {

/// Reads tokens in their common forms straight from the tokenizer's window: complete in it, and behind nothing but
/// spaces, tabs and line ends with LF. It is a copy of the tokenizer's position, which only Tokenizer::accept() moves,
/// so that a reader may give up at any token and leave the text to the tokenizer. Each take function skips white space
/// and reads one token; if the token has another form, the result says so, and the position becomes invalid.
class PlainText {
public:
  /// Nothing to read.
  PlainText() = default;
  /// @param window `size` bytes followed by kScannerReach zeros
  /// @param window_offset offset of the window in the content
  /// @param line_start offset of the first byte of the line in the content
  PlainText(const char* window, size_t size, size_t position, uint64_t window_offset, uint32_t line,
            uint64_t line_start)
      : at_(window + position), end_(window + size), window_(window), window_offset_(window_offset),
        line_start_(line_start), line_(line) {}

  /// The first byte of the next token, or of something else that is not white space; 0 at the window's end.
  char peek() {
    for (; at_ < end_; ++at_) {
      const char c = *at_;
      if (c == '\n')
        ++line_, line_start_ = offset() + 1;
      else if (c != ' ' && c != '\t' && !(c == '\r' && at_[1] == '\n'))
        return c;
    }
    return '\0';
  }
  /// Reads one character: a bracket.
  bool take(char c) {
    if (peek() != c) return false;
    mark_token();
    ++at_;
    return true;
  }
  /// The next word, which is not consumed; empty if there is none or it may continue beyond the window.
  std::string_view peek_word() {
    if (!is_word_byte(peek())) return {};
    const size_t length = count_word_bytes(at_);
    return at_ + length < end_ ? std::string_view(at_, length) : std::string_view();
  }
  /// Consumes the word that peek_word() returned.
  void take_word(std::string_view word) {
    mark_token();
    at_ += word.size();
  }
  /// Reads a string on one line without backslashes.
  /// @param text the characters between its quotes
  bool take_string(std::string_view& text) {
    if (peek() != '"') return false;
    mark_token();
    const char* const first = at_ + 1;
    const char* const close = first + count_plain_string_bytes(first);
    if (close >= end_ || *close != '"') return false;
    text = {first, static_cast<size_t>(close - first)};
    at_ = close + 1;
    return true;
  }
  /// Reads a number with one of number.h's scanners.
  template <class Scan, class T>
  bool take_number(Scan scan, T& value) {
    if (peek() == '\0') return false;
    const char* const end = scan(at_, value);
    if (!end || end >= end_) return false;
    at_ = end;
    return true;
  }
  /// Like take_number(), for a number that the tokenizer would have read as a word.
  template <class Scan, class T>
  bool take_number_word(Scan scan, T& value) {
    peek();
    mark_token();
    return take_number(scan, value);
  }
  /// Whether a word follows that is not a number, nan or inf. May be false for such words, too.
  bool other_word_follows() {
    const char c = static_cast<char>(peek() | 0x20);
    if (c < 'a' || c > 'z' || at_ + 2 >= end_) return false;
    const auto lower = [&](size_t i) { return static_cast<char>(at_[i] | 0x20); };
    return !(c == 'n' && lower(1) == 'a' && lower(2) == 'n') && !(c == 'i' && lower(1) == 'n' && lower(2) == 'f');
  }

  /// Offset in the content.
  uint64_t offset() const { return window_offset_ + static_cast<uint64_t>(at_ - window_); }
  uint32_t line() const { return line_; }
  uint64_t line_start() const { return line_start_; }
  /// Moves to an offset within the window.
  void move_to(uint64_t offset, uint32_t line, uint64_t line_start) {
    at_ = window_ + (offset - window_offset_);
    line_ = line, line_start_ = line_start;
  }
  /// Position of the last token; numbers that take_number() read do not count.
  uint32_t token_line() const { return token_line_; }
  uint32_t token_column() const {
    return static_cast<uint32_t>(std::min<uint64_t>(token_offset_ - token_line_start_ + 1, UINT32_MAX));
  }

private:
  void mark_token() { token_offset_ = offset(), token_line_ = line_, token_line_start_ = line_start_; }

  const char* at_ = nullptr;
  const char* end_ = nullptr;
  const char* window_ = nullptr;
  uint64_t window_offset_ = 0;
  uint64_t line_start_ = 0;
  uint64_t token_offset_ = 0;
  uint64_t token_line_start_ = 0;
  uint32_t line_ = 1;
  uint32_t token_line_ = 1;
};

} // namespace packtrace
