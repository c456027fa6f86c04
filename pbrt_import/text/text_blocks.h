#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <memory>
#include <span>
#include <vector>

#include <tbb/task_group.h>

#include "pbrt_import/text/input_file.h"

namespace packtrace {

/// A run of numbers separated by white space only.
struct NumberRun {
  enum class Kind : uint8_t { kInteger, kFloat, kDouble };
  uint64_t begin = 0;      ///< offset in the content, before any white space that precedes the first number
  uint64_t end = 0;        ///< one past the last character of the run
  uint64_t line_start = 0; ///< offset of the last line that starts in the run; only valid if line_ends > 0
  uint32_t line_ends = 0;  ///< line ends in the run
  uint32_t first = 0;      ///< index into the block's numbers of this kind
  uint32_t count = 0;
  Kind kind = Kind::kFloat;
};

/// A block of a file's content: text in [offset, offset + size), followed by kScannerReach zeros. The next block starts
/// before this one ends, so that a token that starts in a block is complete in it unless it is long.
struct TextBlock {
  uint64_t offset = 0;
  size_t size = 0;
  bool last = false;           ///< the content ends with this block
  std::vector<char> text;      ///< at least size + kScannerReach
  std::vector<NumberRun> runs; ///< sorted by begin
  std::vector<int32_t> integers;
  std::vector<float> floats;
  std::vector<double> doubles;
};

/// Finds and converts runs of numbers in the block's text: after each `[`, at the start of the block, where an array of
/// the previous block may continue, and in arrays after words that are not plain numbers. The text is not parsed; runs
/// inside a comment, for example, are converted and never used.
/// @param stride distance between the offsets of this block and the next
void find_number_runs(TextBlock& block, uint64_t stride);

/// The content of a file as a sequence of blocks. If there are several threads, they read blocks and convert their
/// numbers ahead of use. The blocks do not depend on the number of threads.
class TextBlocks {
public:
  /// @param block_bytes distance between the offsets of consecutive blocks, at least 1
  TextBlocks(InputFile file, size_t block_bytes);
  ~TextBlocks();
  TextBlocks(const TextBlocks&) = delete;
  TextBlocks& operator=(const TextBlocks&) = delete;

  /// Returns the block at offset block_bytes() * number, and invalidates the previous one. Numbers must increase and
  /// end at the last block. Throws Error like InputFile::read.
  const TextBlock& at(uint64_t number);

  size_t block_bytes() const { return stride_; }
  const InputFile& file() const { return file_; }

private:
  enum class State : uint32_t { kFree, kQueued, kRunning, kDone };
  struct Slot {
    TextBlock block;
    std::atomic<State> state{State::kFree};
    std::exception_ptr failure;
  };

  void queue(uint64_t number);
  void inflate(TextBlock& block);
  bool try_work(Slot& slot);
  void work_until_done(Slot& slot);
  Slot& slot_of(uint64_t number) { return *slots_[number % slots_.size()]; }

  InputFile file_;
  size_t stride_;
  std::vector<std::unique_ptr<Slot>> slots_; ///< ring buffer of blocks
  uint64_t queued_ = 0;                      ///< blocks with smaller numbers have been queued
  uint64_t next_ = 0;                        ///< blocks with smaller numbers have been returned or skipped
  bool inflated_all_ = false;
  std::exception_ptr damage_;                ///< error of a compressed file, located after the queued blocks
  std::vector<char> carry_;                  ///< compressed files: content read beyond the last queued block's stride
  std::unique_ptr<tbb::task_group> helpers_; ///< null: only the calling thread works
};

} // namespace packtrace
