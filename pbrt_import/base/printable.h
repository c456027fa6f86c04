#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace packtrace {

/// Bytes of the well-formed UTF-8 character at the start of text; 0 if there is none (Unicode 15, table 3-7).
size_t utf8_length(std::string_view text);

/// Bytes of the character at the start of text if it is printable: well-formed UTF-8 that is neither a control
/// character (C0, DEL, C1) nor invisible formatting (bidirectional controls, zero-width characters, joiners, line and
/// paragraph separators, tags, byte order marks). Otherwise 0. Precondition: text is not empty.
size_t printable_length(std::string_view text);

/// Text that is safe to write to a terminal, whatever files and names it quotes: bytes that are not printable become
/// \xNN.
/// @param layout characters that are kept even so
std::string printable(std::string_view text, std::string_view layout = "\n\t");

/// Converts text to valid UTF-8: bytes that are not UTF-8 are read as Latin-1.
std::string to_utf8(std::string_view text);

} // namespace packtrace
