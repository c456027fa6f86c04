#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace packtrace {

/// Bytes of the well-formed UTF-8 character at the start of text; 0 where there is none (Unicode 15, table 3-7).
size_t utf8_length(std::string_view text);

/// Bytes of the character at the start of text if a terminal shows it where it stands: one of UTF-8 that is neither a
/// control character (C0, DEL, C1) nor invisible formatting (bidirectional controls, zero-width characters, joiners,
/// line and paragraph separators, tags, byte order marks). 0 otherwise. text is not empty.
size_t printable_length(std::string_view text);

/// Text as a terminal may get it, whatever files and names it quotes: what is not printable as \xNN, byte by byte.
/// @param layout characters that stay all the same
std::string printable(std::string_view text, std::string_view layout = "\n\t");

/// The same text in valid UTF-8: bytes that are none are read as Latin-1.
std::string to_utf8(std::string_view text);

} // namespace packtrace
