#pragma once

#include <span>
#include <string>
#include <string_view>

namespace legopt {

/// The candidate with the smallest edit distance to `word` (insert, delete, replace, swap of neighbours; each counts 1,
/// letter case is ignored); the first one on a tie. Empty when there are no candidates.
std::string NearestName(std::string_view word, std::span<const std::string> candidates);

/// The nearest candidate if it is close, that is if no more than half of the letters differ; else empty.
std::string CloseName(std::string_view word, std::span<const std::string> candidates);

/// "did you mean 'X'? valid: A, B, C" for an error's fix. Leaves the guess out when nothing is close.
std::string SuggestName(std::string_view word, std::span<const std::string> candidates);

/// True when `word` was certainly meant to be one of the candidates: one edit away, or two of a word of six letters or
/// more, counted as above.
bool IsMisspelling(std::string_view word, std::span<const std::string> candidates);

}  // namespace legopt
