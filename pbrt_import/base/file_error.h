#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/base/error.h"

namespace packtrace {

/// An Error that concerns a file; what() is "file:line:column: problem".
class FileError : public Error {
public:
  FileError(ErrorKind kind, const std::filesystem::path& file, const std::string& problem)
      : Error(kind, file.string() + ": " + problem), file_(file.string()) {}

  /// @param location position in the file; without a file, what() is the problem alone
  FileError(ErrorKind kind, const SourceLocation& location, const std::string& problem)
      : Error(kind, location.file ? to_string(location) + ": " + problem : problem),
        file_(location.file ? location.file->path : std::string()), line_(location.line), column_(location.column) {}

  const std::string& file() const { return file_; } ///< empty: no file
  uint32_t line() const { return line_; }           ///< from 1; 0: the file as a whole
  uint32_t column() const { return column_; }       ///< in bytes, from 1; 0: the line as a whole

private:
  std::string file_;
  uint32_t line_ = 0, column_ = 0;
};

} // namespace packtrace
