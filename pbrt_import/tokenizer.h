#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/input_file.h"

namespace packtrace {

enum class TokenKind : uint8_t {
  kWord,               ///< a directive or a number
  kString,             ///< text: the characters between the quotes, escapes untouched
  kOpen,               ///< [
  kClose,              ///< ]
  kUnterminatedString, ///< text: what there was up to the end of the line
  kBadByte,            ///< text: the one byte that no pbrt file has
  kEnd,                ///< end of the file, again and again
};

struct Token {
  TokenKind kind = TokenKind::kEnd;
  std::string_view text; ///< valid until the tokenizer is asked for anything else
  uint32_t line = 0;     ///< of the first character, from 1
  uint32_t column = 0;   ///< in bytes, from 1
};

/// Splits one pbrt-v3 file into tokens in a single pass over a window of it. Lines end with LF, CR LF or CR; a UTF-8
/// byte order mark is skipped. Memory: one window, larger only for tokens larger than it.
class Tokenizer {
public:
  static constexpr size_t kDefaultWindow = 256 * 1024;

  /// Throws Error like InputFile::read, and Error(kInput) for UTF-16.
  explicit Tokenizer(InputFile file, size_t window_bytes = kDefaultWindow);

  /// The next token. Throws Error like InputFile::read.
  Token next();

  /// Appends the run of plain numbers that starts here; stops before anything that needs next() to decide, which
  /// includes numbers in uncommon notation. Throws Error like InputFile::read.
  void read_numbers(std::vector<float>& values);
  void read_numbers(std::vector<double>& values);
  void read_numbers(std::vector<int32_t>& values);

  /// Content bytes consumed.
  uint64_t consumed_bytes() const { return window_offset_ + position_; }
  const InputFile& file() const { return file_; }

private:
  /// Discards what is consumed and reads on. False if nothing more came.
  bool refill();
  bool skip_space_and_comments();
  void skip_comment();
  void count_line_end(size_t at);
  Token read_string();
  Token read_word();
  Token make(TokenKind kind, size_t start, size_t end) const;
  void check_encoding();
  template <class T, class Scan>
  void read_run(std::vector<T>& values, Scan scan);

  InputFile file_;
  std::vector<char> window_; ///< size_ bytes, then kScannerReach zeros
  size_t size_ = 0;
  size_t position_ = 0;
  uint64_t window_offset_ = 0; ///< of window_[0] in the content
  bool at_end_ = false;        ///< the file has nothing after the window
  uint32_t line_ = 1;
  uint64_t line_start_ = 0; ///< offset of the line's first byte in the content
  uint32_t token_line_ = 1;
  uint32_t token_column_ = 1;
};

/// The text a string token stands for: \b \f \n \r \t \\ \' \" replaced, other back-slashes kept.
/// @param unknown_escape set to true where a back-slash was kept
std::string unescape(std::string_view raw, bool& unknown_escape);

/// Text for messages, in double quotes: unprintable bytes as \xNN, cut after max_length characters.
inline constexpr size_t kMaxShownPath = 4096;
std::string in_quotes(std::string_view text, size_t max_length = 60);

} // namespace packtrace
