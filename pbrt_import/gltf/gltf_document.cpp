#include "pbrt_import/gltf/gltf_document.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <system_error>

#include "pbrt_import/gltf/gltf_compression.h"
#include "pbrt_import/text/input_file.h"
#include "pbrt_import/text/problem_text.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace::gltf {
namespace {

[[noreturn]] void fail(const std::string& problem) { throw Error(ErrorKind::kInput, problem); }

constexpr std::array<std::string_view, 17> kKnownExtensions = {"EXT_mesh_gpu_instancing",
                                                               "EXT_meshopt_compression",
                                                               "EXT_texture_webp",
                                                               "KHR_draco_mesh_compression",
                                                               "KHR_lights_punctual",
                                                               "KHR_materials_clearcoat",
                                                               "KHR_materials_emissive_strength",
                                                               "KHR_materials_ior",
                                                               "KHR_materials_sheen",
                                                               "KHR_materials_specular",
                                                               "KHR_materials_transmission",
                                                               "KHR_materials_unlit",
                                                               "KHR_materials_volume",
                                                               "KHR_mesh_quantization",
                                                               "KHR_texture_transform",
                                                               "KHR_materials_anisotropy",
                                                               "KHR_materials_iridescence"};

uint32_t read_word(std::span<const std::byte> bytes, size_t at) {
  uint32_t word;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

std::vector<std::byte> decode_base64(std::string_view text) {
  std::vector<std::byte> bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  uint32_t word = 0, bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    const int value = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+' || c == '-' ? 62
                      : c == '/' || c == '_' ? 63
                                             : -1;
    if (value < 0) fail("a data URI with a character that is not base64");
    word = word << 6 | static_cast<uint32_t>(value), bits += 6;
    if (bits >= 8) bits -= 8, bytes.push_back(static_cast<std::byte>(word >> bits & 0xff));
  }
  return bytes;
}

/// Replaces %20 and the like.
std::string decode_percent(std::string_view text) {
  std::string decoded;
  const auto digit = [](char c) {
    return c >= '0' && c <= '9' ? c - '0' : (c | 32) >= 'a' && (c | 32) <= 'f' ? (c | 32) - 'a' + 10 : -1;
  };
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && digit(text[i + 1]) >= 0 && digit(text[i + 2]) >= 0) {
      decoded += static_cast<char>(digit(text[i + 1]) * 16 + digit(text[i + 2]));
      i += 2;
    } else {
      decoded += text[i];
    }
  }
  return decoded;
}

} // namespace

Document::Document(const std::filesystem::path& file, uint32_t file_number, const MeshFileContext& context)
    : context_(context), folder_(std::filesystem::absolute(file).parent_path()), file_number_(file_number),
      content_(read_padded(file, context)), memory_(context.options.memory), values_memory_(context.options.memory) {
  json_text_ = content_.text;
  if (json_text_.starts_with("glTF")) split_binary();
  parse(json_text_);
  const std::string version = root().at("asset").at("version").text();
  if (!version.starts_with("2.") && version != "2")
    throw Error(ErrorKind::kUnsupported, "glTF version " + in_quotes(version) + "; only version 2 is read");
  check_extensions();
}

/// Finds the chunks of a .glb file. Source: glTF 2.0 specification, chapter 4.
void Document::split_binary() {
  const std::span<const std::byte> bytes(content_.bytes.data(), content_.text.size());
  constexpr size_t kHeader = 12, kChunkHeader = 8;
  constexpr uint32_t kJson = 0x4E4F534A, kBinary = 0x004E4942;
  if (bytes.size() < kHeader) fail("the file ends inside its header");
  if (read_word(bytes, 4) != 2)
    throw Error(ErrorKind::kUnsupported,
                "binary glTF version " + std::to_string(read_word(bytes, 4)) + "; only version 2 is read");
  if (read_word(bytes, 8) > bytes.size())
    fail("the file is truncated: its header claims " + std::to_string(read_word(bytes, 8)) + " bytes");
  json_text_ = {};
  size_t at = kHeader;
  for (bool first = true; bytes.size() - at >= kChunkHeader; first = false) {
    const size_t length = read_word(bytes, at);
    const uint32_t type = read_word(bytes, at + 4);
    at += kChunkHeader;
    if (length > bytes.size() - at) fail("a chunk is longer than the file");
    if (first && type == kJson)
      json_text_ = content_.text.substr(at, length);
    else if (type == kBinary && binary_.empty())
      binary_ = bytes.subspan(at, length);
    at += length;
  }
  if (json_text_.empty()) fail("the file does not begin with a JSON chunk");
}

void Document::parse(std::string_view text) {
  constexpr uint64_t kDomBytesPerByte = 24; // "[0,0,..." becomes values of 16 bytes
  memory_.resize(kDomBytesPerByte * text.size(), "the glTF document");
  try {
    json_ = nlohmann::json::parse(text.begin(), text.end());
  } catch (const nlohmann::json::parse_error& error) {
    const size_t at = std::min(error.byte, text.size());
    const std::string_view before = text.substr(0, at);
    const auto line = 1 + std::ranges::count(before, '\n');
    const size_t line_start = before.rfind('\n');
    const size_t column = line_start == std::string_view::npos ? at : at - line_start - 1;
    throw FileError(ErrorKind::kInput,
                    context_.feed.reporter().locate({file_number_, static_cast<uint32_t>(line),
                                                     static_cast<uint32_t>(std::max<size_t>(column, 1))}),
                    "malformed JSON");
  } catch (const nlohmann::json::out_of_range&) {
    fail("a number in the JSON text is too large");
  }
  if (!json_.is_object()) fail("the JSON text is not an object");
}

void Document::check_extensions() const {
  const std::optional<Value> required = root().find("extensionsRequired");
  for (size_t i = 0; required && i < required->size(); ++i) {
    const std::string name = (*required)[i].text();
    if (std::ranges::find(kKnownExtensions, name) == kKnownExtensions.end())
      throw Error(ErrorKind::kUnsupported,
                  "the file requires the extension " + in_quotes(name) + ", which is not supported");
  }
  const std::optional<Value> used = root().find("extensionsUsed");
  for (size_t i = 0; used && i < used->size(); ++i)
    if (const std::string name = (*used)[i].text(); std::ranges::find(kKnownExtensions, name) == kKnownExtensions.end())
      context_.feed.reporter().warning(place(), "the extension " + in_quotes(name) + " is left out");
}

Value Document::element(const char* array, uint64_t index) const {
  return root().at(array)[static_cast<size_t>(index)];
}

size_t Document::count(const char* array) const {
  const std::optional<Value> found = root().find(array);
  return found ? found->size() : 0;
}

std::filesystem::path Document::uri_file(const Value& uri) const {
  const std::string name = decode_percent(uri.text());
  if (name.empty()) uri.fail("is empty");
  if (name.find("://") != std::string::npos) uri.fail("is not a file beside the document: " + in_quotes(name));
  if (name.find('\0') != std::string::npos) uri.fail("has a zero byte");
  std::filesystem::path path = (folder_ / name).lexically_normal();
  std::error_code error;
  if (name.find('\\') != std::string::npos && !std::filesystem::exists(path, error)) {
    std::string slashes = name;
    std::ranges::replace(slashes, '\\', '/');
    path = (folder_ / slashes).lexically_normal();
    context_.feed.reporter().warning(place(), "file names have back-slashes, " + in_quotes(name) + "; read as slashes");
  }
  if (context_.options.allow_uris_outside_folder) return path;
  error.clear();
  const std::filesystem::path folder = std::filesystem::weakly_canonical(folder_, error);
  if (!error) path = std::filesystem::weakly_canonical(path, error);
  const std::filesystem::path inside = path.lexically_relative(folder);
  if (error || inside.empty() || *inside.begin() == "..")
    uri.fail("leads out of the document's folder: " + in_quotes(name) + "; --allow-outside reads it");
  return path;
}

std::span<const std::byte> Document::keep(std::vector<std::byte> bytes) {
  memory_.resize(memory_.bytes() + bytes.capacity(), "the glTF document's buffers");
  kept_.push_back(std::make_unique<std::vector<std::byte>>(std::move(bytes)));
  return *kept_.back();
}

std::span<const std::byte> Document::uri_bytes(const Value& uri) {
  const std::string_view text = uri.text();
  if (text.starts_with("data:")) {
    const size_t comma = text.find(',');
    if (comma == std::string_view::npos || !text.substr(0, comma).ends_with(";base64"))
      uri.fail("is not a base64 data URI");
    return keep(decode_base64(text.substr(comma + 1)));
  }
  const std::filesystem::path path = uri_file(uri);
  context_.named.push_back(path);
  try {
    MemoryReservation memory(context_.options.memory);
    std::vector<std::byte> bytes = read_whole_file(path, context_.options.max_file_bytes, &memory);
    ++context_.statistics.files_read;
    context_.statistics.bytes_read += bytes.size();
    memory.release();
    return keep(std::move(bytes));
  } catch (const MemoryError&) {
    throw;
  } catch (const Error& error) {
    uri.fail("names " + in_quotes(path.string(), kMaxShownPath) + ": " + error.what());
  }
}

template <class Read>
std::span<const std::byte> Document::read_once(std::map<uint64_t, Content>& contents, uint64_t number,
                                               const Read& read) {
  const auto [place, added] = contents.try_emplace(number);
  Content& content = place->second;
  if (added) content.problem = problem_of([&] { content.bytes = read(); });
  if (!content.problem.empty()) fail(content.problem);
  return content.bytes;
}

std::span<const std::byte> Document::buffer_bytes(uint64_t number) {
  const Value buffer = element("buffers", number);
  const std::optional<Value> uri = buffer.find("uri");
  if (!uri && (number != 0 || binary_.data() == nullptr)) buffer.fail("has no uri, and is not the binary chunk");
  const std::span<const std::byte> bytes = read_once(buffers_, number, [&] { return uri ? uri_bytes(*uri) : binary_; });
  const uint64_t length = buffer.at("byteLength").integer();
  if (length > bytes.size())
    buffer.fail("claims " + std::to_string(length) + " bytes, but has " + std::to_string(bytes.size()));
  return bytes.first(static_cast<size_t>(length));
}

std::span<const std::byte> Document::image_bytes(uint64_t number) {
  return read_once(images_, number, [&] {
    const Value image = element("images", number);
    const std::optional<Value> uri = image.find("uri");
    return uri ? uri_bytes(*uri) : view_bytes(image.at("bufferView").integer());
  });
}

std::span<const std::byte> Document::view_bytes(uint64_t number) {
  return read_once(views_, number, [&] { return read_view(number); });
}

std::span<const std::byte> Document::read_view(uint64_t number) {
  const Value view = element("bufferViews", number);
  const auto part_of = [&](const Value& range) {
    const std::span<const std::byte> buffer = buffer_bytes(range.at("buffer").integer());
    const uint64_t offset = range.find_integer("byteOffset").value_or(0), length = range.at("byteLength").integer();
    if (offset > buffer.size() || length > buffer.size() - offset) range.fail("lies outside its buffer");
    return buffer.subspan(static_cast<size_t>(offset), static_cast<size_t>(length));
  };
  const std::optional<Value> compressed = view.extension("EXT_meshopt_compression");
  if (!compressed) return part_of(view);
  const MeshoptView layout = read_meshopt_view(*compressed);
  if (layout.bytes() > view.at("byteLength").integer()) view.fail("is shorter than its compressed content");
  MemoryReservation memory(context_.options.memory);
  memory.resize(layout.bytes(), "decompressing a buffer view");
  std::vector<std::byte> bytes = decode_meshopt(layout, part_of(*compressed), *compressed);
  memory.release();
  return keep(std::move(bytes));
}

} // namespace packtrace::gltf
