#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "pbrt_import/base/output_file.h"

namespace packtrace::scenegen {

/// Buffered writer on top of OutputFile. Creates missing folders. The file gets its name in close(); without close(),
/// no file remains. All functions throw Error(kIo) if an operation fails.
class BufferedFile {
public:
  /// Throws Error(kIo) if the file exists and overwrite is false.
  BufferedFile(const std::filesystem::path& path, bool overwrite);

  void write(std::string_view bytes);
  /// Writes the bytes of an object's memory representation.
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

  OutputFile output_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  std::vector<char> buffer_;
};

} // namespace packtrace::scenegen
