#include "pbrt_import/base/closest_name.h"

#include <algorithm>
#include <vector>

namespace packtrace {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }

/// Twice the edit distance, where letters that differ only in case count 1.
size_t doubled_distance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = 2 * j;
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = 2 * i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t change = a[i - 1] == b[j - 1] ? 0 : lower(a[i - 1]) == lower(b[j - 1]) ? 1 : 2;
      const size_t best = std::min({row[j] + 2, row[j - 1] + 2, diagonal + change});
      diagonal = row[j];
      row[j] = best;
    }
  }
  return row[b.size()];
}

} // namespace

std::string_view closest_name(std::string_view name, std::span<const std::string_view> candidates) {
  constexpr size_t kLongestName = 64;
  if (name.empty() || name.size() > kLongestName) return {};
  std::string_view best;
  // Two edits, but at most a third of the name: "Ks" is not a misspelling of "Kd". One difference in case is always
  // allowed.
  size_t best_distance = 2 * std::min<size_t>(2, name.size() / 3) + 2;
  for (const std::string_view candidate : candidates) {
    if (candidate == name || candidate.size() > name.size() + 2 || name.size() > candidate.size() + 2) continue;
    if (const size_t distance = doubled_distance(name, candidate); distance < best_distance)
      best = candidate, best_distance = distance;
  }
  return best;
}

std::string did_you_mean_text(std::string_view shown) {
  return shown.empty() ? std::string() : "; did you mean " + std::string(shown) + "?";
}

} // namespace packtrace
