#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/text/reporter.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {

/// Limits for reading the text of a scene.
struct SourceLimits {
  uint32_t max_depth = 64;               ///< files open at once, including the main file
  uint64_t max_files = 1'000'000;        ///< files opened in total; bounds Includes that double at every level
  uint64_t max_file_bytes = 16ull << 30; ///< content of one file in bytes, after inflating
};

/// The tokens of the main file and all included files as one stream, so that a construct may start in an included file
/// and continue in the including one. Reports bytes that are not valid in text.
class SourceStack {
public:
  /// Throws Error(kInput), "path: message", if the main file cannot be read.
  SourceStack(const std::filesystem::path& main_file, const SourceLimits& limits, SourceFiles& files,
              Reporter& reporter);

  /// The next token; stays the same until consume().
  const Token& peek();
  void consume() { peeked_ = false; }
  /// Position of the token that peek() returned.
  Place place() const { return {files_open_.back().number, token_.line, token_.column}; }

  /// Calls Tokenizer::read_numbers() of the current file. Only valid directly after consume().
  template <class T, class Take>
  void read_numbers(Take take) {
    guarded([&](Tokenizer& tokenizer) { tokenizer.read_numbers<T>(take); });
  }

  /// Tokenizer::read_bare_number() of the current file. Only valid directly after consume() or read_numbers().
  template <class T>
  bool read_bare_number(T& value) {
    return !gave_up_ && files_open_.back().tokenizer.read_bare_number(value);
  }

  /// The text behind the last token, to be read ahead; none if a token was peeked and not consumed.
  PlainText plain_text() const { return peeked_ || gave_up_ ? PlainText() : files_open_.back().tokenizer.plain_text(); }
  /// Consumes all that was read from plain_text(), after which no other function was called.
  void accept(const PlainText& text) {
    files_open_.back().tokenizer.accept(text);
    token_ = {TokenKind::kWord, {}, text.token_line(), text.token_column()};
  }
  /// Tokenizer::take_array() of the current file.
  template <class T>
  NumberSpans<T> take_array(PlainText& text) {
    return files_open_.back().tokenizer.take_array<T>(text);
  }
  /// Place::file of the current file.
  uint32_t file() const { return files_open_.back().number; }

  /// Continues with the start of another file. If the file cannot be included, this is reported and reading continues
  /// after the Include.
  /// @param place position of the Include directive
  void include(const std::filesystem::path& path, const Place& place);

  uint64_t files_opened() const { return opened_; }
  /// Content bytes consumed so far in all files.
  uint64_t bytes_read() const;

private:
  struct OpenFile {
    Tokenizer tokenizer;
    uint32_t number = 0; ///< number in SourceFiles
    uint32_t bad_bytes = 0;
  };

  template <class Work>
  void guarded(Work work);
  void give_up(const std::string& why);
  void report_bad_byte();

  SourceLimits limits_;
  SourceFiles& files_;
  Reporter& reporter_;
  std::vector<OpenFile> files_open_;
  uint64_t opened_ = 0;
  uint64_t closed_bytes_ = 0;
  Token token_;
  bool peeked_ = false;
  bool gave_up_ = false; ///< the rest of the innermost file is skipped
};

template <class Work>
void SourceStack::guarded(Work work) {
  if (gave_up_) return;
  try {
    work(files_open_.back().tokenizer);
  } catch (const MemoryError&) {
    throw;
  } catch (const std::runtime_error& error) {
    give_up(error.what());
  }
}

} // namespace packtrace
