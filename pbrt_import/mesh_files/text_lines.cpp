#include "pbrt_import/mesh_files/text_lines.h"

#include <algorithm>

#include "pbrt_import/text/number.h"

namespace packtrace {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\0'; }

size_t after_line_end(std::string_view text, size_t end) {
  if (end >= text.size()) return text.size();
  return end + (text[end] == '\r' && end + 1 < text.size() && text[end + 1] == '\n' ? 2 : 1);
}

} // namespace

TextLines::TextLines(std::string_view text) : text_(text) {
  if (text.starts_with("\xef\xbb\xbf")) next_ = 3; // UTF-8 byte order mark
}

size_t TextLines::line_end(size_t from) {
  // Both searches are needed once per line end only, whichever kind the file has.
  if (line_feed_ < from || line_feed_ == 0) line_feed_ = std::min(text_.find('\n', from), text_.size());
  const size_t carriage_return = text_.substr(0, line_feed_).find('\r', from);
  return std::min(carriage_return, line_feed_);
}

bool TextLines::next() {
  while (next_ < text_.size()) {
    size_t end = line_end(next_);
    line_ = text_.substr(next_, end - next_);
    number_ = next_number_++;
    next_ = after_line_end(text_, end);
    if (line_.ends_with('\\')) {
      joined_ = line_;
      while (joined_.ends_with('\\') && next_ < text_.size()) {
        joined_.back() = ' ';
        end = line_end(next_);
        joined_ += text_.substr(next_, end - next_);
        ++next_number_;
        next_ = after_line_end(text_, end);
      }
      const size_t size = joined_.size();
      joined_.append(kScannerReach, '\0');
      line_ = std::string_view(joined_).substr(0, size);
    }
    at_ = 0;
    skip_space();
    if (at_ < line_.size()) return true;
  }
  return false;
}

void TextLines::skip_space() {
  while (at_ < line_.size() && is_blank(line_[at_])) ++at_;
  if (at_ < line_.size() && line_[at_] == '#') at_ = line_.size();
}

LineWord TextLines::word() {
  skip_space();
  const size_t start = at_;
  while (at_ < line_.size() && !is_blank(line_[at_])) ++at_;
  return {line_.substr(start, at_ - start), static_cast<uint32_t>(start + 1)};
}

LineWord TextLines::peek() {
  const size_t before = at_;
  const LineWord next_word = word();
  at_ = before;
  return next_word;
}

std::optional<float> TextLines::number_word() {
  skip_space();
  if (at_ == line_.size()) return std::nullopt;
  float value;
  const char* const start = line_.data() + at_;
  if (const char* const end = scan_float(start, value); end && end <= line_.data() + line_.size()) {
    at_ += static_cast<size_t>(end - start);
    return value;
  }
  const std::string_view text = peek().text;
  const NumberText<float> number = parse_number<float>(text);
  if (number.used != text.size()) return std::nullopt;
  word();
  return number.value;
}

std::string_view TextLines::rest() {
  while (at_ < line_.size() && is_blank(line_[at_])) ++at_;
  std::string_view rest = line_.substr(at_);
  at_ = line_.size();
  while (!rest.empty() && is_blank(rest.back())) rest.remove_suffix(1);
  return rest;
}

} // namespace packtrace
