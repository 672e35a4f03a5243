#include "legopt/types/nearest_name.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <vector>

namespace legopt {
namespace {

char Lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

// Optimal string alignment distance, computed with three rows of the table.
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), previous(b.size() + 1), current(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) previous[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = Lower(a[i - 1]) == Lower(b[j - 1]);
      current[j] = std::min({previous[j] + 1, current[j - 1] + 1, previous[j - 1] + (same ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && Lower(a[i - 1]) == Lower(b[j - 2]) && Lower(a[i - 2]) == Lower(b[j - 1]);
      if (swapped) current[j] = std::min(current[j], before[j - 2] + 1);
    }
    before.swap(previous);
    previous.swap(current);
  }
  return previous[b.size()];
}

}  // namespace

std::string NearestName(std::string_view word, std::span<const std::string> candidates) {
  const auto best = std::min_element(candidates.begin(), candidates.end(), [&](const auto& a, const auto& b) {
    return EditDistance(word, a) < EditDistance(word, b);
  });
  return best == candidates.end() ? std::string() : *best;
}

std::string CloseName(std::string_view word, std::span<const std::string> candidates) {
  std::string nearest = NearestName(word, candidates);
  const bool close = EditDistance(word, nearest) <= std::max(word.size(), nearest.size()) / 2;
  return close ? nearest : std::string();
}

std::string SuggestName(std::string_view word, std::span<const std::string> candidates) {
  const std::string close = CloseName(word, candidates);
  std::string text = (close.empty() ? "" : "did you mean '" + close + "'? ") + std::string("valid: ");
  for (std::size_t i = 0; i < candidates.size(); ++i) text += (i == 0 ? "" : ", ") + candidates[i];
  return text;
}

bool IsMisspelling(std::string_view word, std::span<const std::string> candidates) {
  constexpr std::size_t kLongWord = 6, kLongestName = 64;
  if (word.size() > kLongestName) return false;
  const std::string nearest = NearestName(word, candidates);
  return !nearest.empty() && EditDistance(word, nearest) <= (nearest.size() < kLongWord ? 1U : 2U);
}

}  // namespace legopt
