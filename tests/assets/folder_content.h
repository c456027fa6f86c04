#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>

#include <gtest/gtest.h>

namespace packtrace::scenegen {

/// Content of every file under a folder by its relative path.
inline std::map<std::string, std::string> files_under(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    files[std::filesystem::relative(entry.path(), folder).string()] =
        std::string(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return files;
}

/// Names the first difference instead of printing megabytes.
inline testing::AssertionResult same_files(const std::map<std::string, std::string>& a,
                                           const std::map<std::string, std::string>& b) {
  for (const auto& [name, content] : a) {
    const auto other = b.find(name);
    if (other == b.end()) return testing::AssertionFailure() << name << " is only in the first";
    if (other->second != content) return testing::AssertionFailure() << name << " differs";
  }
  for (const auto& [name, content] : b) {
    if (!a.contains(name)) return testing::AssertionFailure() << name << " is only in the second";
  }
  return testing::AssertionSuccess() << a.size() << " equal files";
}

} // namespace packtrace::scenegen
