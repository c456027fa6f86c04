#include "compress/exchange/gltf/gltf_model.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

// Leaves room for the JSON part.
constexpr uint64_t kMaxBytes = std::numeric_limits<uint32_t>::max() - (uint64_t{64} << 20);
constexpr const char* kMeshopt = "EXT_meshopt_compression";

void append_bytes(std::vector<std::byte>& to, const void* bytes, size_t size) {
  const auto* const begin = static_cast<const std::byte*>(bytes);
  to.insert(to.end(), begin, begin + size);
}

void append_word(std::vector<std::byte>& to, uint64_t value) {
  if (value > std::numeric_limits<uint32_t>::max())
    throw Error(ErrorKind::kLimitExceeded, "more than the 4 GiB that a .glb file holds");
  const auto word = static_cast<uint32_t>(value);
  append_bytes(to, &word, sizeof word);
}

/// A file name as a relative URI. Source: RFC 3986, section 2.
std::string percent_encoded(const std::string& name) {
  constexpr std::string_view kPlain = "-._~", kDigits = "0123456789ABCDEF";
  std::string uri;
  for (const char c : name) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    const auto byte = static_cast<unsigned char>(c);
    if (letter || kPlain.find(c) != std::string_view::npos)
      uri += c;
    else
      uri.append({'%', kDigits[byte >> 4], kDigits[byte & 15u]});
  }
  return uri;
}

} // namespace

double shortest(float value) {
  std::array<char, 32> text;
  const std::to_chars_result end = std::to_chars(text.data(), text.data() + text.size(), value);
  double result = 0.0;
  std::from_chars(text.data(), end.ptr, result);
  return result;
}

GltfJson shortest(std::span<const float> values) {
  GltfJson array = GltfJson::array();
  for (const float value : values) {
    const double number = shortest(value);
    constexpr double kExact = 1e15;
    if (number == std::floor(number) && std::abs(number) < kExact)
      array.push_back(static_cast<int64_t>(number)); // without ".0"
    else
      array.push_back(number);
  }
  return array;
}

GltfModel::GltfModel() {
  json_["asset"] = {{"version", "2.0"}, {"generator", "packtrace"}};
  json_["scene"] = 0;
  json_["scenes"] = GltfJson::array({{{"nodes", GltfJson::array()}}});
}

int GltfModel::add(const char* array, GltfJson element) {
  GltfJson& elements = json_[array];
  elements.push_back(std::move(element));
  return static_cast<int>(elements.size() - 1);
}

size_t GltfModel::count(const char* array) const {
  const auto found = json_.find(array);
  return found == json_.end() ? 0 : found->size();
}

uint64_t GltfModel::append(std::span<const std::byte> bytes) {
  buffer_.resize((buffer_.size() + 3) / 4 * 4);
  if (bytes.size() > kMaxBytes - std::min<uint64_t>(kMaxBytes, buffer_.size()))
    throw Error(ErrorKind::kLimitExceeded, "more than the 4 GiB that a .glb file holds");
  const uint64_t offset = buffer_.size();
  append_bytes(buffer_, bytes.data(), bytes.size());
  return offset;
}

int GltfModel::add_view(std::span<const std::byte> bytes, int target) {
  GltfJson view{{"buffer", 0}, {"byteOffset", append(bytes)}, {"byteLength", bytes.size()}};
  if (target != 0) view["target"] = target;
  return add("bufferViews", std::move(view));
}

int GltfModel::add_compressed_view(std::span<const std::byte> compressed, int target, const MeshoptCoding& coding) {
  const int view = reserve_view();
  fill_compressed_view(view, compressed, target, coding);
  return view;
}

void GltfModel::fill_compressed_view(int number, std::span<const std::byte> compressed, int target,
                                     const MeshoptCoding& coding) {
  uncompressed_bytes_ = (uncompressed_bytes_ + 3) / 4 * 4;
  const uint64_t bytes = coding.count * coding.stride;
  GltfJson view{{"buffer", 1}, {"byteOffset", uncompressed_bytes_}, {"byteLength", bytes}};
  uncompressed_bytes_ += bytes;
  if (target != 0) view["target"] = target;
  if (target == kGltfVertices) view["byteStride"] = coding.stride;
  GltfJson extension{{"buffer", 0},           {"byteOffset", append(compressed)}, {"byteLength", compressed.size()},
                     {"count", coding.count}, {"byteStride", coding.stride},      {"mode", coding.mode}};
  if (!coding.filter.empty()) extension["filter"] = coding.filter;
  view["extensions"][kMeshopt] = std::move(extension);
  element("bufferViews", number) = std::move(view);
  use_extension(kMeshopt, true);
}

void GltfModel::use_extension(const std::string& name, bool required) {
  for (const char* const list : {"extensionsUsed", "extensionsRequired"}) {
    if (list == std::string_view("extensionsRequired") && !required) continue;
    GltfJson& names = json_[list];
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
}

void GltfModel::finish() {
  for (const char* const list : {"extensionsUsed", "extensionsRequired"})
    if (count(list) > 0) std::sort(json_[list].begin(), json_[list].end());
  if (!buffer_.empty()) json_["buffers"] = GltfJson::array({{{"byteLength", buffer_.size()}}});
  if (uncompressed_bytes_ > 0)
    json_["buffers"].push_back(
        {{"byteLength", uncompressed_bytes_}, {"extensions", {{kMeshopt, {{"fallback", true}}}}}});
}

std::vector<std::byte> GltfModel::write_binary() {
  buffer_.resize((buffer_.size() + 3) / 4 * 4);
  finish();
  std::string text = json_.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  constexpr uint64_t kHeader = 12, kChunkHeader = 8;
  constexpr uint32_t kMagic = 0x46546C67, kVersion = 2, kJson = 0x4E4F534A, kBinary = 0x004E4942;
  const uint64_t binary = buffer_.empty() ? 0 : kChunkHeader + buffer_.size();
  std::vector<std::byte> bytes;
  bytes.reserve(kHeader + kChunkHeader + text.size() + binary);
  append_word(bytes, kMagic);
  append_word(bytes, kVersion);
  append_word(bytes, kHeader + kChunkHeader + text.size() + binary);
  append_word(bytes, text.size());
  append_word(bytes, kJson);
  append_bytes(bytes, text.data(), text.size());
  if (binary == 0) return bytes;
  append_word(bytes, buffer_.size());
  append_word(bytes, kBinary);
  append_bytes(bytes, buffer_.data(), buffer_.size());
  return bytes;
}

std::vector<std::byte> GltfModel::write_text(const std::string& buffer_name) {
  finish();
  if (!buffer_.empty()) json_["buffers"][0]["uri"] = percent_encoded(buffer_name);
  const std::string text = json_.dump(1) + "\n";
  std::vector<std::byte> bytes;
  append_bytes(bytes, text.data(), text.size());
  return bytes;
}

} // namespace packtrace
