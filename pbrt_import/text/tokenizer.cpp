#include "pbrt_import/text/tokenizer.h"

#include <algorithm>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/printable.h"
#include "pbrt_import/text/scan_tokens.h"

namespace packtrace {

Tokenizer::Tokenizer(InputFile file, size_t window_bytes)
    : blocks_(std::make_unique<TextBlocks>(std::move(file), window_bytes)) {
  show(blocks_->at(0));
  check_encoding();
}

void Tokenizer::check_encoding() {
  const auto starts_with = [&](std::string_view mark) {
    return std::string_view(window_, size_).substr(0, mark.size()) == mark;
  };
  if (starts_with("\xff\xfe") || starts_with("\xfe\xff"))
    throw Error(ErrorKind::kInput,
                "the file is UTF-16 text (it starts with the byte order mark U+FEFF in 16 bits); save it as UTF-8");
  if (starts_with("\xef\xbb\xbf")) position_ = 3, line_start_ = 3;
}

void Tokenizer::show(const TextBlock& block) {
  const uint64_t offset = consumed_bytes();
  block_ = &block;
  run_ = 0;
  window_ = block.text.data();
  size_ = block.size;
  window_offset_ = block.offset;
  position_ = std::min(static_cast<size_t>(offset - block.offset), size_);
  at_end_ = block.last;
}

bool Tokenizer::refill() {
  if (at_end_) return false;
  const uint64_t offset = consumed_bytes();
  const uint64_t wanted = offset / blocks_->block_bytes(), last = block_->offset / blocks_->block_bytes();
  if (wanted > last) {
    show(blocks_->at(wanted));
    return true;
  }
  // The token that starts here is longer than the overlap of blocks.
  const size_t kept = size_ - position_;
  if (window_ == joined_.data())
    joined_.erase(joined_.begin(), joined_.begin() + static_cast<std::ptrdiff_t>(position_));
  else
    joined_.assign(window_ + position_, window_ + size_);
  joined_.resize(kept); // removes the zeros
  block_ = &blocks_->at(last + 1);
  run_ = 0;
  const size_t known = std::min(static_cast<size_t>(offset + kept - block_->offset), block_->size);
  joined_.insert(joined_.end(), block_->text.data() + known, block_->text.data() + block_->size);
  size_ = joined_.size();
  joined_.resize(size_ + kScannerReach, '\0');
  window_ = joined_.data();
  window_offset_ = offset;
  position_ = 0;
  at_end_ = block_->last;
  return size_ > kept;
}

void Tokenizer::skip(const NumberRun& run) {
  position_ = static_cast<size_t>(run.end - window_offset_);
  line_ += run.line_ends;
  if (run.line_ends > 0) line_start_ = run.line_start;
}

void Tokenizer::count_line_end(size_t at) {
  ++line_;
  line_start_ = window_offset_ + at + 1;
}

void Tokenizer::skip_comment() {
  while (true) {
    const char* const end = window_ + size_;
    const char* const start = window_ + position_;
    const char* const stop = std::find_if(start, end, [](char c) { return c == '\n' || c == '\r'; });
    position_ = static_cast<size_t>(stop - window_);
    if (stop != end || !refill()) return;
  }
}

bool Tokenizer::skip_space_and_comments() {
  while (true) {
    while (position_ == size_)
      if (!refill()) return false;
    const char c = window_[position_];
    if (static_cast<unsigned char>(c) > '#') return true;
    if (c == '\n') {
      count_line_end(position_);
    } else if (c == '\r') {
      if (position_ + 1 == size_) refill(); // LF of a CR LF may follow
      if (window_[position_ + 1] != '\n') count_line_end(position_);
    } else if (c == '#') {
      skip_comment();
      continue;
    } else if (c != ' ' && c != '\t') {
      return true;
    }
    ++position_;
  }
}

Token Tokenizer::make(TokenKind kind, size_t start, size_t end) const {
  return {kind, {window_ + start, end - start}, token_line_, token_column_};
}

Token Tokenizer::next() {
  if (window_ == joined_.data() && consumed_bytes() >= block_->offset) show(*block_);
  const bool found = skip_space_and_comments();
  token_line_ = line_;
  token_column_ = static_cast<uint32_t>(std::min<uint64_t>(consumed_bytes() - line_start_ + 1, UINT32_MAX));
  if (!found) return make(TokenKind::kEnd, position_, position_);
  const char c = window_[position_];
  if (c == '"') return read_string();
  if (is_word_byte(c)) return read_word();
  const TokenKind kind = c == '[' ? TokenKind::kOpen : c == ']' ? TokenKind::kClose : TokenKind::kBadByte;
  ++position_;
  return make(kind, position_ - 1, position_);
}

Token Tokenizer::read_string() {
  constexpr uint32_t kMaxStringBadBytes = 16; // strings with more are treated as binary data
  size_t length = 1;                          // relative to position_, which refill() changes
  size_t bad_at = 0;                          // of the first bad byte, relative to position_
  uint32_t bad_bytes = 0;
  bool too_long = false;
  const auto end = [&](TokenKind kind, size_t text_end, size_t next) {
    if (too_long || length > kMaxTokenBytes) {
      position_ = next;
      return make(TokenKind::kTooLong, next, next);
    }
    const size_t start = position_ + (bad_bytes > 0 ? bad_at : 1);
    if (bad_bytes > 0) token_column_ += static_cast<uint32_t>(bad_at);
    position_ = next;
    return bad_bytes > 0 ? make(TokenKind::kBadByte, start, start + 1) : make(kind, start, std::max(start, text_end));
  };
  while (true) {
    if (length > kMaxTokenBytes) cut(length), too_long = true;
    if (position_ + length >= size_ && !refill()) break;
    length += count_plain_string_bytes(window_ + position_ + length);
    if (position_ + length >= size_) continue;
    const char c = window_[position_ + length];
    if (c == '"') return end(TokenKind::kString, position_ + length, position_ + length + 1);
    if (c == '\n' || c == '\r' || bad_bytes == kMaxStringBadBytes) break;
    if (detail::is_bad_string_byte(c) && bad_bytes++ == 0) bad_at = length;
    if (c == '\\') {
      if (position_ + length + 1 >= size_) refill();
      const char escaped = window_[position_ + length + 1];
      if (escaped == '"' || escaped == '\\') ++length;
    }
    ++length;
  }
  const size_t rest = std::min(position_ + length, size_);
  return end(TokenKind::kUnterminatedString, rest, rest);
}

void Tokenizer::cut(size_t& length) {
  position_ = std::min(position_ + length, size_);
  length = 0;
}

Token Tokenizer::read_word() {
  size_t length = 1;
  bool too_long = false;
  while (true) {
    if (length > kMaxTokenBytes) cut(length), too_long = true;
    if (position_ + length >= size_ && !refill()) break;
    if (position_ + length >= size_) continue;
    length += count_word_bytes(window_ + position_ + length);
    if (position_ + length < size_) break;
  }
  const size_t start = position_;
  position_ += length;
  if (too_long || length > kMaxTokenBytes) return make(TokenKind::kTooLong, position_, position_);
  return make(TokenKind::kWord, start, position_);
}

std::string unescape(std::string_view raw, bool& unknown_escape) {
  std::string text;
  text.reserve(raw.size());
  for (size_t i = 0; i < raw.size(); ++i) {
    constexpr std::string_view kLetters = "bfnrt\\'\"", kMeanings = "\b\f\n\r\t\\'\"";
    const size_t escape = raw[i] == '\\' && i + 1 < raw.size() ? kLetters.find(raw[i + 1]) : std::string_view::npos;
    if (escape != std::string_view::npos) {
      text += kMeanings[escape];
      ++i;
    } else {
      unknown_escape = unknown_escape || raw[i] == '\\';
      text += raw[i];
    }
  }
  return text;
}

std::string in_quotes(std::string_view text, size_t max_length) {
  std::string shown(1, '"');
  for (size_t i = 0; i < text.size();) {
    if (shown.size() > max_length) {
      shown += "...";
      break;
    }
    const size_t length = std::max<size_t>(printable_length(text.substr(i)), 1);
    shown += printable(text.substr(i, length), "");
    i += length;
  }
  shown += '"';
  return shown;
}

} // namespace packtrace
