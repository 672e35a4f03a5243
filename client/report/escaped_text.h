#pragma once

#include <string>
#include <string_view>

#include "app/printable.h"
#include "legopt/input/json.h"

namespace legopt::client {

/// Returns JSON as printed by commands, without a line end: `indent` spaces per level, or one line (-1). Invalid UTF-8
/// is replaced; terminal control characters are escaped, so parsers still get the original values.
template <class Json>
std::string JsonText(const Json& json, int indent = 2) {
  return app::PrintableJson(Dump(json, indent));
}

/// Escapes a text for LaTeX with the encodings OT1 and T1 and babel's shorthands: active characters are escaped, and
/// characters that fonts join ("--", "''", ",,", "?`") are separated.
std::string LatexText(std::string_view text);

/// Returns comment lines with the packages that a LaTeX text needs: booktabs, T1 for the straight double quote, and an
/// encoding for characters beyond ASCII.
std::string LatexNeeds(std::string_view latex);

/// Escapes a text for Markdown and HTML: `<`, `>`, `&`, backslash, `|`, backtick and square brackets.
std::string MarkdownText(std::string_view text);

}  // namespace legopt::client
