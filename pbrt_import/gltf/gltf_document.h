#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/gltf/gltf_json.h"
#include "pbrt_import/mesh_files/mesh_file_context.h"

namespace packtrace::gltf {

/// A glTF 2.0 document, as .gltf or .glb, with its buffers, which are read when they are first used.
class Document {
public:
  /// Reads the JSON text. Throws Error(kInput) if the file cannot be read or is not glTF 2.0; Error(kUnsupported) if it
  /// requires an extension that is not known; MemoryError.
  /// @param file_number of the file in SourceFiles
  Document(const std::filesystem::path& file, uint32_t file_number, const MeshFileContext& context);

  Value root() const { return {json_, {}}; }
  /// Element of a top-level array, such as meshes[3].
  Value element(const char* array, uint64_t index) const;
  /// Number of elements of a top-level array, 0 if it is absent.
  size_t count(const char* array) const;

  /// Bytes of a buffer view, decoded if it is compressed by EXT_meshopt_compression. They live as long as the document.
  std::span<const std::byte> view_bytes(uint64_t view);

  /// Bytes of an image, which are read once. They live as long as the document.
  std::span<const std::byte> image_bytes(uint64_t image);

  /// Path of the file that a URI names. Back-slashes are read as slashes, with a warning, if no file has the name as
  /// written. Throws if the file is not within the document's folder and files outside are not allowed; otherwise links
  /// in the path are resolved.
  std::filesystem::path uri_file(const Value& uri) const;

  uint32_t file_number() const { return file_number_; }
  /// Place for messages about the document: it has no lines that matter.
  Place place() const { return {file_number_, 0, 0}; }
  const MeshFileContext& context() const { return context_; }
  /// Reservation for all memory of the document.
  MemoryReservation& memory() { return memory_; }
  /// Counts the values of accessors that are in use; see ValuesInUse.
  MemoryReservation& values_memory() { return values_memory_; }

private:
  /// Data that are read once, or the reason why they could not be read.
  struct Content {
    std::span<const std::byte> bytes;
    std::string problem; ///< empty: none
  };
  /// Bytes of an element; read() gives them at its first use. Later uses throw the same Error(kInput) if it failed.
  template <class Read>
  static std::span<const std::byte> read_once(std::map<uint64_t, Content>& contents, uint64_t number, const Read& read);
  void parse(std::string_view text);
  void split_binary();
  void check_extensions() const;
  std::span<const std::byte> buffer_bytes(uint64_t buffer);
  std::span<const std::byte> read_view(uint64_t view);
  /// Bytes that a URI names: a data URI, or a file beside the document.
  std::span<const std::byte> uri_bytes(const Value& uri);
  std::span<const std::byte> keep(std::vector<std::byte> bytes);

  MeshFileContext context_;
  std::filesystem::path folder_;
  uint32_t file_number_;
  PaddedText content_;
  std::string_view json_text_;
  std::span<const std::byte> binary_; ///< chunk of a .glb file
  nlohmann::json json_;
  std::map<uint64_t, Content> buffers_, views_, images_; ///< read so far; buffers to their ends
  std::vector<std::unique_ptr<std::vector<std::byte>>> kept_;
  MemoryReservation memory_, values_memory_;
};

/// Until it ends, the values that accessors give are counted as memory; an accessor without a buffer view claims any
/// amount of it.
class ValuesInUse {
public:
  explicit ValuesInUse(Document& document) : memory_(document.values_memory()), before_(memory_.bytes()) {}
  ~ValuesInUse() { memory_.resize(before_, {}); } // never grows, so it does not throw
  ValuesInUse(const ValuesInUse&) = delete;
  ValuesInUse& operator=(const ValuesInUse&) = delete;

private:
  MemoryReservation& memory_;
  uint64_t before_;
};

} // namespace packtrace::gltf
