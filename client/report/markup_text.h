#pragma once

#include <string>
#include <string_view>

namespace legopt::client {

/// A text as LaTeX prints it, in the encodings OT1 and T1 and with babel's shorthands: every active character is
/// escaped, and characters that a font would join ("--", "''", ",,", "?`") are kept apart.
std::string LatexText(std::string_view text);

/// Comment lines that name the packages which a LaTeX text needs: booktabs, T1 for the straight double quote, and an
/// encoding for characters beyond ASCII.
std::string LatexNeeds(std::string_view latex);

/// A text as Markdown and HTML show it: `<`, `>`, `&`, backslash, `|`, backtick and square brackets are escaped.
std::string MarkdownText(std::string_view text);

}  // namespace legopt::client
