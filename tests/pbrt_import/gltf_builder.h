#pragma once

#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace packtrace {

/// Makes glTF documents for tests: values become accessors of one buffer.
class GltfBuilder {
public:
  using Json = nlohmann::json;

  GltfBuilder() { json = {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", Json::array()}}}}}; }

  Json json;

  /// Appends bytes as a buffer view; returns its number.
  size_t view(std::string_view bytes) {
    buffer_.resize((buffer_.size() + 3) / 4 * 4);
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes.size()}});
    buffer_ += bytes;
    return json["bufferViews"].size() - 1;
  }
  template <class T>
  size_t view(const std::vector<T>& values) {
    return view(std::string_view(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)));
  }

  /// Adds an accessor of values; returns its number.
  template <class T>
  size_t accessor(const std::string& type, uint32_t component, const std::vector<T>& values) {
    const size_t size = type == "SCALAR" ? 1 : static_cast<size_t>(type[3] - '0');
    return accessor(
        {{"bufferView", view(values)}, {"componentType", component}, {"type", type}, {"count", values.size() / size}});
  }
  size_t accessor(const Json& accessor) {
    json["accessors"].push_back(accessor);
    return json["accessors"].size() - 1;
  }
  size_t positions(const std::vector<float>& xyz) { return accessor("VEC3", 5126, xyz); }

  size_t mesh(const Json& primitive) {
    json["meshes"].push_back({{"primitives", {primitive}}});
    return json["meshes"].size() - 1;
  }
  /// Adds a node of the scene.
  size_t node(const Json& node) {
    json["nodes"].push_back(node);
    json["scenes"][0]["nodes"].push_back(json["nodes"].size() - 1);
    return json["nodes"].size() - 1;
  }

  /// The document as text with its buffer as a data URI.
  std::string text() const {
    Json whole = json;
    whole["buffers"] = {
        {{"byteLength", buffer_.size()}, {"uri", "data:application/octet-stream;base64," + base64(buffer_)}}};
    return whole.dump(1);
  }
  /// The document as a .glb file.
  std::string binary() const {
    Json whole = json;
    whole["buffers"] = {{{"byteLength", buffer_.size()}}};
    std::string document = whole.dump(), data = buffer_;
    document.resize((document.size() + 3) / 4 * 4, ' ');
    data.resize((data.size() + 3) / 4 * 4, '\0');
    std::string file = "glTF";
    const auto word = [&](size_t value) {
      const auto v = static_cast<uint32_t>(value);
      file.append(reinterpret_cast<const char*>(&v), 4);
    };
    word(2), word(12 + 8 + document.size() + 8 + data.size());
    word(document.size()), file += "JSON", file += document;
    word(data.size()), file.append("BIN\0", 4), file += data;
    return file;
  }

  static std::string base64(std::string_view bytes) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (size_t i = 0; i < bytes.size(); i += 3) {
      uint32_t word = 0;
      for (size_t k = 0; k < 3; ++k) word = word << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0);
      for (size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[word >> (18 - 6 * k) & 63] : '=';
    }
    return text;
  }

private:
  std::string buffer_;
};

} // namespace packtrace
