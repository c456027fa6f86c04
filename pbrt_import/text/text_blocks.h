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

/// Numbers in a row, with nothing but space between them.
struct NumberRun {
  enum class Kind : uint8_t { kInteger, kFloat, kDouble };
  uint64_t begin = 0;      ///< offset in the content, of the space before the first number if there is any
  uint64_t end = 0;        ///< one past the last character that belongs to the run
  uint64_t line_start = 0; ///< offset of the last line that begins in the run; only where line_ends > 0
  uint32_t line_ends = 0;  ///< in the run
  uint32_t first = 0;      ///< into the block's numbers of this kind
  uint32_t count = 0;
  Kind kind = Kind::kFloat;
};

/// A piece of a file's content: text in [offset, offset + size), followed by kScannerReach zeros. The blocks after it
/// start before it ends, so that what begins in one block is whole in it unless it is long.
struct TextBlock {
  uint64_t offset = 0;
  size_t size = 0;
  bool last = false;      ///< the content ends with this block
  std::vector<char> text; ///< at least size + kScannerReach
  std::vector<NumberRun> runs; ///< in order of begin
  std::vector<int32_t> integers;
  std::vector<float> floats;
  std::vector<double> doubles;
};

/// Finds runs of numbers in the block's text: after each `[`, at its start, where an array may go on that began before,
/// and after words in arrays that are not plain numbers. What the text means is not known here: a run may lie in a
/// comment, and is of no use then.
/// @param stride distance from this block's offset to the next one's
void find_number_runs(TextBlock& block, uint64_t stride);

/// The content of a file, block by block in order. Blocks are read, and their numbers converted, ahead of use by
/// other threads where there are some; the blocks are the same for any number of threads.
class TextBlocks {
public:
  /// @param block_bytes distance between the offsets of blocks, at least 1
  TextBlocks(InputFile file, size_t block_bytes);
  ~TextBlocks();
  TextBlocks(const TextBlocks&) = delete;
  TextBlocks& operator=(const TextBlocks&) = delete;

  /// The block at offset block_bytes() * number; the one asked for before ends here. Numbers must grow, and stop at the
  /// last block. Throws Error like InputFile::read.
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
  std::vector<std::unique_ptr<Slot>> slots_; ///< a ring
  uint64_t queued_ = 0;                      ///< blocks with smaller numbers were queued
  uint64_t next_ = 0;                        ///< blocks with smaller numbers were handed out or skipped
  bool inflated_all_ = false;
  std::exception_ptr damage_;                ///< of a compressed file, behind the blocks queued so far
  std::vector<char> carry_;                 ///< compressed files: what was read beyond the last queued block's stride
  std::unique_ptr<tbb::task_group> helpers_; ///< null: nobody else works on blocks
};

} // namespace packtrace
