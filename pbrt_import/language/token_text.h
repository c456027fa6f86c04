#pragma once

#include <string>

#include "pbrt_import/language/directive_info.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {

/// A token as messages show it: "the string \"a\"".
std::string describe(const Token& token);

inline bool is_directive(const Token& token) {
  return token.kind == TokenKind::kWord && find_directive(token.text) != nullptr;
}

inline bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

/// Whether a token is a number, possibly followed by other characters. A word such as "Info" is not a number, although
/// it starts like one.
bool is_number(const Token& token);

/// Message about a word in place of a directive, with the closest directive's name.
std::string unknown_directive(const Token& token);

} // namespace packtrace
