#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/base/error.h"

namespace packtrace {

/// An Error that a file is to blame for, with the place as it is shown in what(): "file:line:column: problem".
class FileError : public Error {
public:
  FileError(ErrorKind kind, const std::filesystem::path& file, const std::string& problem)
      : Error(kind, file.string() + ": " + problem), file_(file.string()) {}

  /// @param location what() is the problem alone where it names no file
  FileError(ErrorKind kind, const SourceLocation& location, const std::string& problem)
      : Error(kind, location.file ? to_string(location) + ": " + problem : problem),
        file_(location.file ? location.file->path : std::string()), line_(location.line), column_(location.column) {}

  const std::string& file() const { return file_; } ///< empty: none
  uint32_t line() const { return line_; }           ///< from 1; 0: the file as a whole
  uint32_t column() const { return column_; }       ///< from 1, of bytes; 0: the line as a whole

private:
  std::string file_;
  uint32_t line_ = 0, column_ = 0;
};

} // namespace packtrace
