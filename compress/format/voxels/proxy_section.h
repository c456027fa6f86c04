#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Proxies of a validated file as bytes, for read_proxies(); empty if it has none.
std::span<const uint8_t> proxy_bytes(const BakedFile& file);

/// Splits the proxies from the end of a file's texture bytes: the proxies, and `texture_bytes` without them and their
/// size. Nothing if the size is wrong.
std::optional<std::span<const uint8_t>> split_proxies(std::span<const uint8_t>& texture_bytes);

} // namespace packtrace
