#include "pbrt_import/language/token_text.h"

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/text/number.h"
#include "pbrt_import/text/problem_text.h"

namespace packtrace {

std::string describe(const Token& token) {
  switch (token.kind) {
  case TokenKind::kWord:
    return in_quotes(token.text);
  case TokenKind::kString:
    return "the string " + in_quotes(token.text);
  case TokenKind::kOpen:
    return "\"[\"";
  case TokenKind::kClose:
    return "\"]\"";
  case TokenKind::kUnterminatedString:
    return "a string without its closing quote";
  case TokenKind::kBadByte:
    return "a stray byte";
  case TokenKind::kTooLong:
    return "a word or string of more than " + memory_text(kMaxTokenBytes);
  case TokenKind::kEnd:
    return "the end of the file";
  }
  return {};
}

bool is_number(const Token& token) {
  if (token.kind != TokenKind::kWord) return false;
  const size_t used = parse_number<double>(token.text).used;
  return used == token.text.size() || (used > 0 && !is_letter(token.text[0]));
}

std::string unknown_directive(const Token& token) {
  return "unknown directive " + describe(token) + did_you_mean(closest_directive(token.text));
}

} // namespace packtrace
