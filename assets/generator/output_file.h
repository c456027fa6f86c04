#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

namespace packtrace::scenegen {

/// A file under way: written through a buffer to a temporary name beside its own, given its name by close().
/// One that is not closed leaves nothing behind. Every function throws Error(kIo) if the disk refuses.
class OutputFile {
public:
  /// Makes missing folders. Throws Error(kIo) if the file exists and overwrite is false.
  OutputFile(std::filesystem::path path, bool overwrite);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view bytes);
  /// The object's bytes as they lie in memory.
  template <typename T>
  void write_value(const T& value) {
    write(std::string_view(reinterpret_cast<const char*>(&value), sizeof value));
  }
  void close();

private:
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void flush();
  [[noreturn]] void fail(std::string_view action) const;

  std::filesystem::path path_, temporary_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  std::vector<char> buffer_;
  bool closed_ = false;
};

} // namespace packtrace::scenegen
