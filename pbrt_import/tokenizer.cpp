#include "pbrt_import/tokenizer.h"

#include <algorithm>
#include <cstring>

#include "pbrt_import/number.h"
#include "pbrt_import/scene/error.h"

namespace packtrace {
namespace {

// Where a window has fewer bytes left than this, number runs first read on, so that a number is never cut.
constexpr size_t kNumberRoom = 4 * kScannerReach;

bool is_bad_byte(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return (byte < 0x20 && !is_space(c) && c != '\v' && c != '\f') || byte == 0x7f || byte >= 0xf8;
}

} // namespace

Tokenizer::Tokenizer(InputFile file, size_t window_bytes) : file_(std::move(file)) {
  const uint64_t useful =
      file_.compressed() ? window_bytes : std::min<uint64_t>(window_bytes, file_.stored_bytes() + 1);
  window_.resize(std::max<size_t>(static_cast<size_t>(useful), 4) + kScannerReach);
  refill();
  check_encoding();
}

void Tokenizer::check_encoding() {
  const auto starts_with = [&](std::string_view mark) {
    return std::string_view(window_.data(), size_).substr(0, mark.size()) == mark;
  };
  if (starts_with("\xff\xfe") || starts_with("\xfe\xff"))
    throw Error(ErrorKind::kInput,
                "the file is UTF-16 text (it starts with the byte order mark U+FEFF in 16 bits); save it as UTF-8");
  if (starts_with("\xef\xbb\xbf")) position_ = 3, line_start_ = 3;
}

bool Tokenizer::refill() {
  if (at_end_) return false;
  const size_t kept = size_ - position_;
  std::memmove(window_.data(), window_.data() + position_, kept);
  window_offset_ += position_;
  position_ = 0;
  size_ = kept;
  const size_t capacity = window_.size() - kScannerReach;
  if (kept > capacity / 2) window_.resize(capacity * 2 + kScannerReach); // one long token
  const size_t room = window_.size() - kScannerReach - kept;
  const size_t got = file_.read({window_.data() + kept, room});
  at_end_ = got < room;
  size_ = kept + got;
  std::fill_n(window_.data() + size_, kScannerReach, '\0');
  return got > 0;
}

void Tokenizer::count_line_end(size_t at) {
  ++line_;
  line_start_ = window_offset_ + at + 1;
}

void Tokenizer::skip_comment() {
  while (true) {
    const char* const end = window_.data() + size_;
    const char* const start = window_.data() + position_;
    const char* const stop = std::find_if(start, end, [](char c) { return c == '\n' || c == '\r'; });
    position_ = static_cast<size_t>(stop - window_.data());
    if (stop != end || !refill()) return;
  }
}

bool Tokenizer::skip_space_and_comments() {
  while (true) {
    if (position_ == size_ && !refill()) return false;
    const char c = window_[position_];
    if (c == '\n') {
      count_line_end(position_);
    } else if (c == '\r') {
      if (position_ + 1 == size_) refill(); // is the second half of CR LF still to come?
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
  return {kind, {window_.data() + start, end - start}, token_line_, token_column_};
}

Token Tokenizer::next() {
  const bool found = skip_space_and_comments();
  token_line_ = line_;
  token_column_ = static_cast<uint32_t>(std::min<uint64_t>(consumed_bytes() - line_start_ + 1, UINT32_MAX));
  if (!found) return make(TokenKind::kEnd, position_, position_);
  const char c = window_[position_];
  if (c == '"') return read_string();
  if (c != '[' && c != ']' && !is_bad_byte(c)) return read_word();
  const TokenKind kind = c == '[' ? TokenKind::kOpen : c == ']' ? TokenKind::kClose : TokenKind::kBadByte;
  ++position_;
  return make(kind, position_ - 1, position_);
}

Token Tokenizer::read_string() {
  size_t length = 1; // from position_, which refill() moves
  while (true) {
    if (position_ + length >= size_ && !refill()) break;
    if (position_ + length >= size_) continue;
    const char c = window_[position_ + length];
    if (c == '"') {
      const size_t start = position_ + 1;
      position_ += length + 1;
      return make(TokenKind::kString, start, position_ - 1);
    }
    if (c == '\n' || c == '\r') break;
    if (is_bad_byte(c)) {
      token_column_ += static_cast<uint32_t>(length);
      position_ += length + 1;
      return make(TokenKind::kBadByte, position_ - 1, position_);
    }
    if (c == '\\') {
      if (position_ + length + 1 >= size_) refill();
      const char escaped = window_[position_ + length + 1];
      if (escaped == '"' || escaped == '\\') ++length;
    }
    ++length;
  }
  const size_t start = position_ + 1;
  position_ = std::min(position_ + length, size_);
  return make(TokenKind::kUnterminatedString, start, std::max(start, position_));
}

Token Tokenizer::read_word() {
  size_t length = 1;
  while (true) {
    if (position_ + length >= size_ && !refill()) break;
    if (position_ + length >= size_) continue;
    if (const char c = window_[position_ + length]; ends_word(c) || is_bad_byte(c)) break;
    ++length;
  }
  const size_t start = position_;
  position_ += length;
  return make(TokenKind::kWord, start, position_);
}

template <class T, class Scan>
void Tokenizer::read_run(std::vector<T>& values, Scan scan) {
  constexpr size_t kChunk = 1024;
  T chunk[kChunk];
  size_t count = 0;
  while (true) {
    while (!at_end_ && size_ - position_ < kNumberRoom) refill();
    // Before the end of the file a number is scanned only where all of it is certain to be in the window.
    const char* const limit = window_.data() + (at_end_ ? size_ : size_ - kScannerReach);
    const char* p = window_.data() + position_;
    bool stopped = false;
    while (p < limit) {
      if (*p == ' ' || *p == '\t') {
        ++p;
      } else if (*p == '\n') {
        count_line_end(static_cast<size_t>(p++ - window_.data()));
      } else if (*p == '\r') {
        if (p[1] != '\n') count_line_end(static_cast<size_t>(p - window_.data()));
        ++p;
      } else if (const char* const end = scan(p, chunk[count]); end) {
        p = end;
        if (++count == kChunk) {
          values.insert(values.end(), chunk, chunk + count);
          count = 0;
        }
      } else {
        stopped = true;
        break;
      }
    }
    position_ = static_cast<size_t>(p - window_.data());
    if (stopped || at_end_) break;
  }
  values.insert(values.end(), chunk, chunk + count);
}

void Tokenizer::read_numbers(std::vector<float>& values) {
  read_run(values, [](const char* p, float& value) { return scan_float(p, value); });
}

void Tokenizer::read_numbers(std::vector<double>& values) {
  read_run(values, [](const char* p, double& value) { return scan_double(p, value); });
}

void Tokenizer::read_numbers(std::vector<int32_t>& values) {
  read_run(values, [](const char* p, int32_t& value) { return scan_integer(p, value); });
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
  constexpr char kHex[] = "0123456789abcdef";
  std::string shown(1, '"');
  for (const char c : text) {
    if (shown.size() > max_length) {
      shown += "...";
      break;
    }
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7f && byte < 0xf8)
      shown += c;
    else
      shown += {'\\', 'x', kHex[byte >> 4], kHex[byte & 15]};
  }
  shown += '"';
  return shown;
}

} // namespace packtrace
