#include "pbrt_import/text/text_blocks.h"

#include <algorithm>
#include <cstring>
#include <string_view>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "pbrt_import/text/number.h"
#include "pbrt_import/text/number_kernels.h"

namespace packtrace {
namespace {

using Kind = NumberRun::Kind;

static_assert(kScannerReach >= kKernelReach);

// Overlap of a block with the next one: all tokens but the longest are complete in a block.
constexpr size_t kOverlap = 256;
// Smaller files are read faster than a task starts.
constexpr uint64_t kSmallFile = 512 * 1024;
constexpr size_t kBlocksAheadPerThread = 2;
constexpr size_t kMaxBlockThreads = 8; // the parsing thread cannot keep up with more

/// Offset of the first white-space character, npos if there is none.
size_t first_space(std::string_view text) {
  const auto* const found = std::find_if(text.begin(), text.end(), is_space);
  return found == text.end() ? std::string_view::npos : static_cast<size_t>(found - text.begin());
}

/// Type of the numbers after a `[`, guessed from the text before it.
enum class Guess : uint8_t { kUnknown, kInteger, kFloat, kDouble };

Guess guess_from(std::string_view before) {
  while (!before.empty() && is_space(before.back())) before.remove_suffix(1);
  if (before.empty()) return Guess::kUnknown;
  // Transform and ConcatTransform take doubles.
  if (before.back() != '"') return before.back() == 'm' ? Guess::kDouble : Guess::kFloat;
  before.remove_suffix(1);
  const size_t quote = before.rfind('"');
  if (quote == std::string_view::npos) return Guess::kUnknown;
  before.remove_prefix(quote + 1);
  return before.starts_with("integer") ? Guess::kInteger : Guess::kFloat;
}

class RunFinder {
public:
  RunFinder(TextBlock& block, uint64_t stride) : block_(block), text_(block.text.data()) {
    const size_t own = static_cast<size_t>(std::min<uint64_t>(stride, block.size));
    const size_t rest = block.last ? std::string_view::npos : first_space({text_ + own, block.size - own});
    // Without a white-space character to end at, stop before a number that the block's end could cut.
    end_ = text_ + (block.last ? block.size
                    : rest != std::string_view::npos && own + rest + kScannerReach <= block.size
                        ? own + rest
                        : block.size - std::min(block.size, kScannerReach));
  }

  void find() {
    const char* const begin = start();
    read_array(begin, block_.offset == 0 || begin == text_ || begin[-1] != '[' ? Guess::kUnknown : guess_at(begin - 1));
    while (position_ < end_) {
      const void* const open = std::memchr(position_, '[', static_cast<size_t>(end_ - position_));
      if (!open) return;
      const char* const bracket = static_cast<const char*>(open);
      read_array(bracket + 1, guess_at(bracket));
    }
  }

private:
  /// The position at which the previous block stopped, or just after a `[` before it.
  const char* start() const {
    if (block_.offset == 0) return text_ + (std::string_view(text_, block_.size).starts_with("\xef\xbb\xbf") ? 3 : 0);
    const size_t space = std::min(first_space({text_, std::min(block_.size, kOverlap)}), block_.size);
    const size_t bracket = std::string_view(text_, space).rfind('[');
    return text_ + (bracket == std::string_view::npos ? space : bracket + 1);
  }

  Guess guess_at(const char* bracket) const {
    constexpr std::ptrdiff_t kLongestDeclaration = 128;
    const std::ptrdiff_t length = std::min(bracket - text_, kLongestDeclaration);
    return guess_from({bracket - length, static_cast<size_t>(length)});
  }

  /// Converts numbers up to the end of the array, or to a token that no number array contains.
  void read_array(const char* p, Guess guess) {
    position_ = p;
    while (true) {
      read_run(guess);
      if (position_ >= end_ || *position_ == ']' || *position_ == '[' || *position_ == '"') return;
      // Skips a comment, or a word that is not a plain number and is left to the parser. The array continues after it.
      if (*position_ == '#') position_ = std::find_if(position_, end_, [](char c) { return c == '\n' || c == '\r'; });
      const char* const word = std::find_if_not(position_, end_, is_space);
      if (word != end_ && *word == '#') {
        position_ = word;
        continue;
      }
      position_ = std::find_if(word, end_, ends_word);
      if (position_ == word) return;
    }
  }

  void read_run(Guess guess) {
    const char* const begin = position_;
    NumberRun run;
    if (guess == Guess::kInteger || guess == Guess::kUnknown) {
      // Minus zero is not an integer: it would lose the sign that a float keeps.
      const auto scan = [](const char* p, int32_t& value) {
        const char* const end = scan_integer(p, value);
        return end && value == 0 && *p == '-' ? nullptr : end;
      };
      run = convert(block_.integers, scan, kernels_.integers, Kind::kInteger);
      const bool number_follows = position_ < end_ && *position_ != '#' && !ends_word(*position_);
      if (guess == Guess::kUnknown && number_follows) { // a number that is not an integer
        block_.integers.resize(run.first);
        position_ = begin;
        guess = Guess::kFloat;
      }
    }
    if (guess == Guess::kFloat) run = convert(block_.floats, scan_float, kernels_.floats, Kind::kFloat);
    if (guess == Guess::kDouble) run = convert(block_.doubles, scan_double, kernels_.doubles, Kind::kDouble);
    if (run.count > 0) block_.runs.push_back(run);
  }

  template <class T, class Scan, class Kernel>
  NumberRun convert(std::vector<T>& values, Scan scan, Kernel kernel, Kind kind) {
    constexpr size_t kChunk = 512;
    T chunk[kChunk];
    size_t count = 0;
    NumberRun run;
    run.kind = kind;
    run.begin = offset_of(position_);
    run.first = static_cast<uint32_t>(values.size());
    const char* p = position_;
    const auto add_line_ends = [&](uint32_t how_many, const char* last) {
      if (how_many == 0) return;
      run.line_ends += how_many;
      run.line_start = offset_of(last) + 1;
    };
    const auto scan_one = [&] {
      for (; p < end_ && is_space(*p); ++p)
        if (*p == '\n' || (*p == '\r' && p[1] != '\n')) add_line_ends(1, p);
      if (p < end_ && detail::is_digit(*p) && ends_word(p[1])) { // the common case in short arrays
        chunk[count++] = static_cast<T>(*p++ - '0');
        return true;
      }
      const char* const end = p < end_ ? scan(p, chunk[count]) : nullptr;
      if (!end) return false;
      p = end;
      ++count;
      return true;
    };
    // Starting a kernel does not pay off for short arrays.
    constexpr size_t kShortArray = 48;
    if (std::memchr(p, ']', kShortArray)) kernel = nullptr;
    do {
      if (kernel && p - text_ >= static_cast<std::ptrdiff_t>(kKernelLead)) {
        const NumberBatch batch = kernel(p, end_, chunk + count, kChunk - count);
        count += batch.count;
        add_line_ends(batch.line_ends, batch.last_line_end);
        p = batch.end;
      }
      if (count == kChunk) {
        values.insert(values.end(), chunk, chunk + count);
        count = 0;
      }
    } while (scan_one());
    values.insert(values.end(), chunk, chunk + count);
    position_ = p;
    run.end = offset_of(p);
    run.count = static_cast<uint32_t>(values.size()) - run.first;
    return run;
  }

  uint64_t offset_of(const char* p) const { return block_.offset + static_cast<uint64_t>(p - text_); }

  TextBlock& block_;
  const char* text_;
  const char* end_; ///< end of the text that this block converts
  const char* position_ = nullptr;
  const NumberKernels kernels_ = number_kernels() ? *number_kernels() : NumberKernels{};
};

} // namespace

void find_number_runs(TextBlock& block, uint64_t stride) {
  block.runs.clear();
  block.integers.clear();
  block.floats.clear();
  block.doubles.clear();
  RunFinder(block, stride).find();
}

TextBlocks::TextBlocks(InputFile file, size_t block_bytes) : file_(std::move(file)), stride_(block_bytes) {
  const size_t threads =
      std::min<size_t>(static_cast<size_t>(tbb::this_task_arena::max_concurrency()),
                       tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  if (threads > 1 && file_.stored_bytes() >= kSmallFile) helpers_ = std::make_unique<tbb::task_group>();
  slots_.resize(helpers_ ? 1 + kBlocksAheadPerThread * std::min(threads, kMaxBlockThreads) : 1);
  for (std::unique_ptr<Slot>& slot : slots_) slot = std::make_unique<Slot>();
}

TextBlocks::~TextBlocks() {
  if (!helpers_) return;
  for (const std::unique_ptr<Slot>& slot : slots_) {
    State queued = State::kQueued;
    slot->state.compare_exchange_strong(queued, State::kFree);
  }
  helpers_->wait();
}

void TextBlocks::queue(uint64_t number) {
  Slot& slot = slot_of(number);
  slot.failure = damage_;
  TextBlock& block = slot.block;
  block.offset = number * stride_;
  if (file_.compressed() && !damage_) {
    try {
      inflate(block);
    } catch (...) {
      slot.failure = std::current_exception();
      inflated_all_ = true;
    }
  }
  slot.state.store(State::kQueued, std::memory_order_release);
  if (helpers_) helpers_->run([this, &slot] { try_work(slot); });
}

/// Blocks must be inflated in order, so only the thread that calls at() does it.
void TextBlocks::inflate(TextBlock& block) {
  block.text.resize(stride_ + kOverlap + kScannerReach);
  std::copy(carry_.begin(), carry_.end(), block.text.begin());
  const size_t wanted = stride_ + kOverlap;
  block.size = carry_.size() + file_.read({block.text.data() + carry_.size(), wanted - carry_.size()});
  block.last = block.size < wanted;
  if (block.last) {
    try {
      char none;
      (void)file_.read({&none, 1});
    } catch (...) { // report the damage after the content before it
      block.last = false;
      damage_ = std::current_exception();
    }
  }
  inflated_all_ = block.last;
  const auto end = block.text.begin() + static_cast<std::ptrdiff_t>(block.size);
  carry_.assign(std::min(block.text.begin() + static_cast<std::ptrdiff_t>(stride_), end), end);
}

bool TextBlocks::try_work(Slot& slot) {
  State state = State::kQueued;
  if (!slot.state.compare_exchange_strong(state, State::kRunning, std::memory_order_acq_rel)) return false;
  try {
    TextBlock& block = slot.block;
    if (!file_.compressed()) {
      const uint64_t left = file_.stored_bytes() - std::min(file_.stored_bytes(), block.offset);
      // Reads one byte more than expected, which detects the end of the file.
      const size_t wanted = static_cast<size_t>(std::min<uint64_t>(stride_ + kOverlap, left + 1));
      block.text.resize(std::max(block.text.size(), wanted + kScannerReach));
      block.size = file_.read_at(block.offset, {block.text.data(), wanted});
      block.last = block.size < wanted;
    }
    if (!slot.failure) {
      std::fill_n(block.text.data() + block.size, kScannerReach, '\0');
      find_number_runs(block, stride_);
    }
  } catch (...) {
    slot.failure = std::current_exception();
  }
  slot.state.store(State::kDone, std::memory_order_release);
  slot.state.notify_all();
  return true;
}

void TextBlocks::work_until_done(Slot& slot) {
  if (try_work(slot)) return;
  while (slot.state.load(std::memory_order_acquire) != State::kDone) {
    // Another thread works on this block; work on other queued blocks meanwhile.
    const bool worked =
        std::any_of(slots_.begin(), slots_.end(), [&](const std::unique_ptr<Slot>& other) { return try_work(*other); });
    if (!worked) slot.state.wait(State::kRunning, std::memory_order_acquire);
  }
}

const TextBlock& TextBlocks::at(uint64_t number) {
  while (true) {
    const auto more = [&] {
      return queued_ < next_ + slots_.size() &&
             (queued_ == 0 || (file_.compressed() ? !inflated_all_ : queued_ * stride_ < file_.stored_bytes()));
    };
    while (more()) queue(queued_++);
    if (next_ == queued_) queue(queued_++); // the file has grown since it was opened
    Slot& slot = slot_of(next_++);
    work_until_done(slot);
    if (slot.failure) std::rethrow_exception(slot.failure);
    if (next_ > number || slot.block.last) return slot.block;
  }
}

} // namespace packtrace
