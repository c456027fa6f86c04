#include "compress/format/file/mapped_file.h"

#include <cerrno>
#include <string>
#include <system_error>

#include <sys/mman.h>

#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/regular_file.h"

namespace packtrace {

MappedFile::MappedFile(const std::filesystem::path& path) {
  RegularFile file;
  try {
    file = open_regular_file(path);
  } catch (const Error& error) {
    throw FileError(error.kind(), path, error.what());
  }
  const auto size = static_cast<size_t>(file.bytes);
  if (size == 0) return; // mmap refuses it; the reader reports it as truncated
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.descriptor.get(), 0);
  if (address == MAP_FAILED) throw FileError(ErrorKind::kIo, path, std::generic_category().message(errno));
  bytes_ = {static_cast<const std::byte*>(address), size};
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

} // namespace packtrace
