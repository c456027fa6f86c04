#include "assets/generator/output_file.h"

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include "pbrt_import/scene/error.h"

namespace packtrace::scenegen {

namespace {
constexpr size_t kBufferBytes = size_t{1} << 20;
}

OutputFile::OutputFile(std::filesystem::path path, bool overwrite) : path_(std::move(path)), temporary_(path_) {
  temporary_ += ".part";
  std::error_code code;
  if (path_.has_parent_path()) std::filesystem::create_directories(path_.parent_path(), code);
  if (code) throw Error(ErrorKind::kIo, path_.parent_path().string() + ": cannot make the folder: " + code.message());
  if (!overwrite && std::filesystem::exists(path_, code)) {
    throw Error(ErrorKind::kIo, path_.string() + ": exists already; --force overwrites");
  }
  file_.reset(std::fopen(temporary_.c_str(), "wb"));
  if (!file_) fail("cannot create");
  buffer_.reserve(kBufferBytes);
}

OutputFile::~OutputFile() {
  if (closed_) return;
  file_.reset();
  std::error_code ignored; // already on the way out with the first error
  std::filesystem::remove(temporary_, ignored);
}

void OutputFile::write(std::string_view bytes) {
  if (buffer_.size() + bytes.size() > kBufferBytes) flush();
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void OutputFile::close() {
  flush();
  if (std::fclose(file_.release()) != 0) fail("cannot finish writing");
  std::error_code code;
  std::filesystem::rename(temporary_, path_, code);
  if (code) throw Error(ErrorKind::kIo, path_.string() + ": cannot rename into place: " + code.message());
  closed_ = true;
}

void OutputFile::flush() {
  if (std::fwrite(buffer_.data(), 1, buffer_.size(), file_.get()) != buffer_.size()) fail("cannot write");
  buffer_.clear();
}

void OutputFile::fail(std::string_view action) const {
  const int reason = errno;
  throw Error(ErrorKind::kIo, path_.string() + ": " + std::string(action) + ": " + std::strerror(reason));
}

} // namespace packtrace::scenegen
