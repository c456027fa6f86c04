#include "pbrt_import/text/source_stack.h"

#include <algorithm>

#include "pbrt_import/base/file_error.h"

namespace packtrace {
namespace {

// A file with more bad bytes is not text.
constexpr uint32_t kMaxBadBytes = 1000;

std::string byte_name(char c) {
  constexpr char kHex[] = "0123456789ABCDEF";
  const auto byte = static_cast<unsigned char>(c);
  return {'0', 'x', kHex[byte >> 4], kHex[byte & 15]};
}

} // namespace

SourceStack::SourceStack(const std::filesystem::path& main_file, const SourceLimits& limits, SourceFiles& files,
                         Reporter& reporter)
    : limits_(limits), files_(files), reporter_(reporter) {
  try {
    const uint32_t number = files_.add(main_file.string(), std::nullopt);
    files_open_.push_back({Tokenizer(InputFile(main_file, limits_.max_file_bytes)), number, 0});
  } catch (const Error& error) {
    throw FileError(error.kind(), main_file, error.what());
  }
  opened_ = 1;
}

const Token& SourceStack::peek() {
  while (!peeked_) {
    token_ = {TokenKind::kEnd, {}, token_.line, token_.column};
    guarded([&](Tokenizer& tokenizer) { token_ = tokenizer.next(); });
    peeked_ = true;
    if (token_.kind == TokenKind::kBadByte) report_bad_byte();
    if (token_.kind != TokenKind::kEnd || files_open_.size() == 1) break;
    closed_bytes_ += files_open_.back().tokenizer.consumed_bytes();
    files_open_.pop_back();
    gave_up_ = false;
    peeked_ = false;
  }
  return token_;
}

void SourceStack::report_bad_byte() {
  OpenFile& file = files_open_.back();
  const bool nul = token_.text[0] == '\0';
  reporter_.error(place(), "byte " + byte_name(token_.text[0]) + " does not belong in a pbrt file" +
                               (nul ? "; is this UTF-16 text? save it as UTF-8" : ""));
  if (++file.bad_bytes > kMaxBadBytes) give_up("this is not a text file");
}

void SourceStack::give_up(const std::string& why) {
  gave_up_ = true;
  reporter_.error(Place{files_open_.back().number, 0, 0}, why + "; the rest of the file is skipped");
}

void SourceStack::include(const std::filesystem::path& path, const Place& place) {
  const std::string name = in_quotes(path.string(), kMaxShownPath);
  if (files_open_.size() >= limits_.max_depth) {
    reporter_.error(place, "included files are nested more than " + std::to_string(limits_.max_depth) + " deep; " +
                               name + " is skipped");
    return;
  }
  if (opened_ >= limits_.max_files) {
    reporter_.error(place, "more than " + std::to_string(limits_.max_files) +
                               " files are included in all; the rest is skipped");
    return;
  }
  try {
    InputFile file(path, limits_.max_file_bytes);
    for (const OpenFile& open : files_open_)
      if (open.tokenizer.file().same_file(file)) throw Error(ErrorKind::kInput, "the file includes itself");
    constexpr size_t kIncludeWindow = 64 * 1024;
    Tokenizer tokenizer(std::move(file), kIncludeWindow);
    files_open_.push_back({std::move(tokenizer), files_.add(path.string(), place), 0});
    ++opened_;
  } catch (const Error& error) {
    reporter_.error(place, "cannot include " + name + ": " + error.what());
  }
}

uint64_t SourceStack::bytes_read() const {
  uint64_t total = closed_bytes_;
  for (const OpenFile& file : files_open_) total += file.tokenizer.consumed_bytes();
  return total;
}

} // namespace packtrace
