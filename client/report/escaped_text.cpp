#include "client/report/escaped_text.h"

#include <algorithm>
#include <array>

namespace legopt::client {
namespace {

struct LatexEscape {
  char character;
  std::string_view latex;
};
constexpr std::array<LatexEscape, 14> kLatexEscapes = {{{'\\', "\\textbackslash{}"},
                                                        {'~', "\\textasciitilde{}"},
                                                        {'^', "\\textasciicircum{}"},
                                                        {'<', "\\textless{}"},
                                                        {'>', "\\textgreater{}"},
                                                        {'|', "\\textbar{}"},
                                                        {'"', "\\textquotedbl{}"},
                                                        {'&', "\\&"},
                                                        {'%', "\\%"},
                                                        {'$', "\\$"},
                                                        {'#', "\\#"},
                                                        {'_', "\\_"},
                                                        {'{', "\\{"},
                                                        {'}', "\\}"}}};

/// Returns whether fonts join two characters into a ligature.
bool Join(char a, char b) {
  constexpr std::string_view kJoinTwice = "-'`,";
  return (a == b && kJoinTwice.find(a) != std::string_view::npos) || ((a == '?' || a == '!') && b == '`');
}

}  // namespace

std::string LatexText(std::string_view text) {
  std::string latex;
  // The end of a row, "\\\\", would use a following bracket or star as its argument.
  if (text.starts_with('[') || text.starts_with('*')) latex += "{}";
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto found = std::find_if(kLatexEscapes.begin(), kLatexEscapes.end(),
                                    [&](const LatexEscape& escape) { return escape.character == text[i]; });
    if (found != kLatexEscapes.end()) {
      latex += found->latex;
    } else {
      latex += text[i];
    }
    if (i + 1 < text.size() && Join(text[i], text[i + 1])) latex += "{}";
  }
  return latex;
}

std::string LatexNeeds(std::string_view latex) {
  std::string needs = "% needs \\usepackage{booktabs}\n";
  if (latex.find("\\textquotedbl") != std::string_view::npos) needs += "% needs \\usepackage[T1]{fontenc}\n";
  const bool ascii =
      std::all_of(latex.begin(), latex.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
  if (!ascii) needs += "% needs utf8: \\usepackage[utf8]{inputenc}, or XeLaTeX or LuaLaTeX for letters beyond Latin\n";
  return needs;
}

std::string MarkdownText(std::string_view text) {
  constexpr std::string_view kActive = "\\|`[]";  // a preceding backslash makes these characters literal
  std::string escaped;
  for (const char c : text) {
    if (c == '<') {
      escaped += "&lt;";
    } else if (c == '>') {
      escaped += "&gt;";
    } else if (c == '&') {
      escaped += "&amp;";
    } else {
      if (kActive.find(c) != std::string_view::npos) escaped += '\\';
      escaped += c;
    }
  }
  return escaped;
}

}  // namespace legopt::client
