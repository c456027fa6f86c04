#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace packtrace {

/// A word of a line with its column, from 1, in bytes.
struct LineWord {
  std::string_view text;
  uint32_t column = 0;
};

/// Splits the text of OBJ, MTL and STL files into lines of words. A backslash at the end of a line continues it; a
/// word that starts with # begins a comment. Lines end with LF, CR LF or CR.
class TextLines {
public:
  /// @param text the whole file, followed by kScannerReach zeros; must outlive this object
  explicit TextLines(std::string_view text);
  TextLines(const TextLines&) = delete;
  TextLines& operator=(const TextLines&) = delete;

  /// Goes to the next line that has a word; false at the end of the text.
  bool next();
  /// Number of the current line, from 1: the first one of a continued line.
  uint32_t number() const { return number_; }
  uint64_t position() const { return next_; } ///< bytes read

  /// The next word of the line; empty at its end.
  LineWord word();
  /// The word that word() would return.
  LineWord peek();
  /// The next number of the line; none, without moving on, if the next word is not one.
  std::optional<float> number_word();
  /// The rest of the line, without surrounding white space. Comments stay, since file names may contain #.
  std::string_view rest();

private:
  void skip_space();
  /// One past the line that starts at `from`, without its line end.
  size_t line_end(size_t from);

  std::string_view text_;
  std::string joined_;    ///< a continued line, with kScannerReach zeros
  std::string_view line_; ///< followed by readable bytes
  size_t at_ = 0;         ///< in line_
  size_t next_ = 0;       ///< start of the next line in text_
  size_t line_feed_ = 0;  ///< the first line feed from next_ on, or the end; 0: not searched yet
  uint32_t number_ = 0, next_number_ = 1;
};

} // namespace packtrace
