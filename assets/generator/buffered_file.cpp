#include "assets/generator/buffered_file.h"

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include "pbrt_import/base/error.h"

namespace packtrace::scenegen {

namespace {

constexpr size_t kBufferBytes = size_t{1} << 20;

/// Creates the folder of a path if it is missing, and returns the path.
const std::filesystem::path& with_folder(const std::filesystem::path& path) {
  std::error_code code;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), code);
  if (code) throw Error(ErrorKind::kIo, path.parent_path().string() + ": cannot make the folder: " + code.message());
  return path;
}

} // namespace

BufferedFile::BufferedFile(const std::filesystem::path& path, bool overwrite)
    : output_(with_folder(path), overwrite), file_(std::fopen(output_.path().c_str(), "wb")) {
  if (!file_) fail("cannot create");
  buffer_.reserve(kBufferBytes);
}

void BufferedFile::write(std::string_view bytes) {
  if (buffer_.size() + bytes.size() > kBufferBytes) flush();
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void BufferedFile::close() {
  flush();
  if (std::fclose(file_.release()) != 0) fail("cannot finish writing");
  output_.commit();
}

void BufferedFile::flush() {
  if (std::fwrite(buffer_.data(), 1, buffer_.size(), file_.get()) != buffer_.size()) fail("cannot write");
  buffer_.clear();
}

void BufferedFile::fail(std::string_view action) const {
  const int reason = errno;
  throw Error(ErrorKind::kIo, output_.target().string() + ": " + std::string(action) + ": " + std::strerror(reason));
}

} // namespace packtrace::scenegen
