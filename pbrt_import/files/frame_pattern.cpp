#include "pbrt_import/files/frame_pattern.h"

#include <algorithm>
#include <charconv>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr size_t kMaxDigits = 18; // any such number fits int64_t

[[noreturn]] void fail_pattern(const std::string& text, const std::string& what) {
  std::string message = "sequence '";
  message.append(text).append("': ").append(what);
  message.append("; name its files like 'grass_%04d.ply', with one %d or %0Nd for the frame's number");
  throw Error(ErrorKind::kUsage, message);
}

bool is_decimal(char c) { return c >= '0' && c <= '9'; }

} // namespace

FramePattern::FramePattern(const std::string& pattern) : text_(pattern) {
  const std::filesystem::path path(pattern);
  folder_ = path.parent_path();
  const std::string folder = folder_.string(), name = path.filename().string();
  for (size_t i = 0; i < folder.size(); ++i)
    if (folder[i] == '%' && !(i + 1 < folder.size() && folder[++i] == '%'))
      fail_pattern(text_, "the number must be in the file name, not in a folder's");
  std::string plain_folder;
  for (size_t i = 0; i < folder.size(); ++i) {
    plain_folder += folder[i];
    if (folder[i] == '%') ++i;
  }
  folder_ = plain_folder;
  bool found = false;
  for (size_t i = 0; i < name.size(); ++i) {
    std::string& part = found ? after_ : before_;
    if (name[i] != '%') {
      part += name[i];
      continue;
    }
    if (++i < name.size() && name[i] == '%') {
      part += '%';
      continue;
    }
    size_t end = i;
    while (end < name.size() && is_decimal(name[end])) ++end;
    const std::string width = name.substr(i, end - i);
    if (end >= name.size() || name[end] != 'd' || (!width.empty() && (width.size() < 2 || width[0] != '0')))
      fail_pattern(text_, "the directive at character " + std::to_string(i) + " of the file name is not %d or %0Nd");
    if (found) fail_pattern(text_, "it has more than one number");
    found = true;
    if (!width.empty()) {
      const auto [stop, error] = std::from_chars(width.data() + 1, width.data() + width.size(), digits_);
      if (error != std::errc() || digits_ < 1 || digits_ > kMaxDigits)
        fail_pattern(text_, "a number has 1 to " + std::to_string(kMaxDigits) + " digits");
    }
    i = end;
  }
  if (!found) fail_pattern(text_, "it has no number");
}

std::filesystem::path FramePattern::file(int64_t number) const {
  std::string digits = std::to_string(number), name = before_;
  if (digits.size() < digits_) digits.insert(0, digits_ - digits.size(), '0');
  name.append(digits).append(after_);
  return folder_ / name;
}

std::optional<int64_t> FramePattern::number_of(const std::string& file_name) const {
  if (file_name.size() <= before_.size() + after_.size() || !file_name.starts_with(before_) ||
      !file_name.ends_with(after_))
    return std::nullopt;
  const std::string digits = file_name.substr(before_.size(), file_name.size() - before_.size() - after_.size());
  if (digits.size() > kMaxDigits || !std::ranges::all_of(digits, is_decimal)) return std::nullopt;
  int64_t number = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (file(number).filename().string() != file_name) return std::nullopt; // other leading zeros
  return number;
}

FramePattern FramePattern::below(const std::filesystem::path& folder) const {
  FramePattern result = *this;
  result.folder_ = folder / folder_;
  return result;
}

} // namespace packtrace
