#include "compress/format/voxels/proxy_section.h"

#include <cstring>

#include "compress/format/voxels/proxy_format.h"

namespace packtrace {

std::optional<std::span<const uint8_t>> split_proxies(std::span<const uint8_t>& texture_bytes) {
  uint64_t bytes = 0;
  if (texture_bytes.size() < sizeof bytes) return std::nullopt;
  const std::span<const uint8_t> rest = texture_bytes.first(texture_bytes.size() - sizeof bytes);
  std::memcpy(&bytes, rest.data() + rest.size(), sizeof bytes);
  if (bytes > rest.size()) return std::nullopt;
  texture_bytes = rest.first(rest.size() - static_cast<size_t>(bytes));
  return rest.last(static_cast<size_t>(bytes));
}

std::span<const uint8_t> proxy_bytes(const BakedFile& file) {
  if ((file.summary().purpose & voxels::kHasProxies) == 0) return {};
  baked::FileHeader header;
  std::memcpy(&header, file.bytes().data(), sizeof header);
  const baked::SectionRecord& section = header.sections[baked::kTextureBytes];
  std::span<const uint8_t> texture_bytes(reinterpret_cast<const uint8_t*>(file.bytes().data()) + section.offset,
                                         static_cast<size_t>(section.bytes));
  return split_proxies(texture_bytes).value_or(std::span<const uint8_t>{});
}

} // namespace packtrace
