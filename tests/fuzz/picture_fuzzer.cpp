// Fuzzes the reader of EXR pictures whose channels `denoise` replaces and copies. What can be read is written and read
// again.

#include <string_view>

#include "pbrt_import/base/error.h"
#include "runtime/image/exr_picture.h"
#include "tests/fuzz/fuzz_target.h"

namespace packtrace::fuzz {
namespace {

constexpr const char* kAdded = "added";

std::vector<std::string> channels_of(std::span<const std::byte> bytes) {
  std::vector<std::string> names;
  for (const ExrLayer& layer : exr_info(bytes, "input").layers)
    for (const ExrChannel& channel : layer.channels) names.push_back(channel.name);
  return names;
}

void require_copy(const ExrPicture& picture, const std::vector<std::string>& channels, const Layer& added) {
  const std::vector<std::byte> bytes = picture.encode(std::span(&added, 1));
  const ExrPicture copy(bytes, "copy");
  require(copy.size() == picture.size(), "size of the copy");
  for (const std::string& channel : channels) {
    if (channel == kAdded) continue;
    require(copy.type(channel) == picture.type(channel), "type of a copied channel");
    require(copy.words(channel) == picture.words(channel), "samples of a copied channel");
  }
  require(copy.floats(kAdded) == std::vector<float>(picture.size().pixels(), 0.5f), "samples of the added channel");
}

void read_picture(std::span<const std::byte> bytes) {
  try {
    const std::vector<std::string> channels = channels_of(bytes);
    const ExrPicture picture(bytes, "input");
    require(picture.size().pixels() > 0, "picture without pixels");
    for (const std::string& channel : channels) {
      require(picture.type(channel).has_value(), "a channel is missing");
      require(picture.floats(channel).size() == picture.size().pixels(), "number of samples");
    }
    const std::vector<float> samples(picture.size().pixels(), 0.5f);
    require_copy(picture, channels, {kAdded, {""}, samples});
    const ExrPicture one(bytes, "input", std::span(channels.data(), 1));
    require(one.words(channels[0]) == picture.words(channels[0]), "samples of a channel that is read alone");
  } catch (const Error& error) {
    require(error.kind() == ErrorKind::kInput || error.kind() == ErrorKind::kUnsupported, "kind of error");
  }
}

} // namespace
} // namespace packtrace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (std::string_view(reinterpret_cast<const char*>(data), size).starts_with("\x76\x2f\x31\x01"))
    packtrace::fuzz::read_picture(std::as_bytes(std::span(data, size)));
  return 0;
}
