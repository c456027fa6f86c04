#pragma once

#include <cstring>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/error.h"
#include "tests/compress/file_hashes.h"

namespace packtrace::test {

/// Opens a file, which must fail, and returns the kind of error.
inline ErrorKind open_kind(std::span<const std::byte> bytes, std::string* message = nullptr) {
  try {
    (void)BakedFile::from_bytes(bytes);
  } catch (const Error& error) {
    if (message) *message = error.what();
    return error.kind();
  }
  ADD_FAILURE() << "the file was accepted";
  return ErrorKind::kCancelled;
}

/// Changes one u32 of a file and returns the error message of opening it.
template <class T>
std::string message_after(std::vector<std::byte> bytes, baked::Section section, size_t at, T value) {
  baked::FileHeader header;
  std::memcpy(&header, bytes.data(), sizeof header);
  std::memcpy(bytes.data() + header.sections[section].offset + at, &value, sizeof value);
  rehash<baked::FileHeader>(bytes);
  std::string message;
  EXPECT_EQ(open_kind(bytes, &message), ErrorKind::kInput);
  return message;
}

} // namespace packtrace::test
