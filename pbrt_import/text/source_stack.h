#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "pbrt_import/text/reporter.h"
#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {

/// Bounds on what a scene's text may make the reader do.
struct SourceLimits {
  uint32_t max_depth = 64;               ///< files open at once, the main one included
  uint64_t max_files = 1'000'000;        ///< opened in all: includes that double at every level would never end
  uint64_t max_file_bytes = 16ull << 30; ///< content of one file, after inflating
};

/// The tokens of the main file and all it includes, as one stream: whatever began in an included file may go on in
/// the file that included it. Bytes that no text has are reported here.
class SourceStack {
public:
  /// Throws Error(kInput), "path: message", if the main file cannot be read.
  SourceStack(const std::filesystem::path& main_file, const SourceLimits& limits, SourceFiles& files,
              Reporter& reporter);

  /// The token that comes next; the same until consume().
  const Token& peek();
  void consume() { peeked_ = false; }
  /// Of the token that peek() gives.
  Place place() const { return {files_open_.back().number, token_.line, token_.column}; }

  /// Tokenizer::read_numbers of the current file. Only right after consume().
  template <class T, class Take>
  void read_numbers(Take take) {
    guarded([&](Tokenizer& tokenizer) { tokenizer.read_numbers<T>(take); });
  }

  /// Goes on with the start of another file. Reports and stays where it is if that is not possible.
  /// @param place of the Include directive
  void include(const std::filesystem::path& path, const Place& place);

  uint64_t files_opened() const { return opened_; }
  /// Content bytes consumed so far, all files together.
  uint64_t bytes_read() const;

private:
  struct OpenFile {
    Tokenizer tokenizer;
    uint32_t number = 0; ///< in SourceFiles
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
  bool gave_up_ = false; ///< on the innermost file: the rest of it is not read
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
