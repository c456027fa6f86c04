#include "pbrt_import/mesh_files/mesh_file_context.h"

#include "pbrt_import/text/input_file.h"
#include "pbrt_import/text/number.h"

namespace packtrace {

PaddedText read_padded(const std::filesystem::path& file, const MeshFileContext& context) {
  PaddedText read;
  read.memory = MemoryReservation(context.options.memory);
  read.bytes = read_whole_file(file, context.options.max_file_bytes, &read.memory);
  const size_t size = read.bytes.size();
  if (read.bytes.capacity() < size + kScannerReach)
    read.memory.resize(read.memory.bytes() + size + kScannerReach, "the file's text");
  read.bytes.resize(size + kScannerReach);
  read.text = {reinterpret_cast<const char*>(read.bytes.data()), size};
  ++context.statistics.files_read;
  context.statistics.bytes_read += size;
  return read;
}

uint32_t add_source(const std::filesystem::path& file, std::optional<Place> named_at, const MeshFileContext& context) {
  context.named.push_back(file);
  return context.files.add(file.string(), named_at);
}

} // namespace packtrace
