#pragma once

#include <span>
#include <string>
#include <string_view>

namespace legopt {

/// Returns the candidate with the smallest edit distance to `word`; the first one on a tie. Insertion, deletion,
/// replacement and swap of neighbours each count 1; letter case is ignored. Empty if there are no candidates.
std::string NearestName(std::string_view word, std::span<const std::string> candidates);

/// Returns the nearest candidate if at most half of the letters differ, else an empty string.
std::string CloseName(std::string_view word, std::span<const std::string> candidates);

/// Returns advice for an error: "did you mean 'X'? valid: A, B, C". The question is omitted if no candidate is close.
std::string SuggestName(std::string_view word, std::span<const std::string> candidates);

/// Returns true if `word` is almost certainly a misspelt candidate: edit distance 1, or 2 for words of six letters or
/// more. Distances are those of NearestName.
bool IsMisspelling(std::string_view word, std::span<const std::string> candidates);

}  // namespace legopt
