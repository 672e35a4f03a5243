// Policy: LaTeX and Markdown show a name as it was written, in every font encoding and with babel's shorthands.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/report/escaped_text.h"
#include "client/report/listing.h"

namespace legopt::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(LatexText, EveryActiveCharacterIsEscaped) {
  EXPECT_EQ(LatexText("a<b>c|d\"e"), "a\\textless{}b\\textgreater{}c\\textbar{}d\\textquotedbl{}e");
  EXPECT_EQ(LatexText("\\ ~ ^"), "\\textbackslash{} \\textasciitilde{} \\textasciicircum{}");
  EXPECT_EQ(LatexText("& % $ # _ { }"), "\\& \\% \\$ \\# \\_ \\{ \\}");
  EXPECT_EQ(LatexText("SQP, 80 (a+b)/c = 1; d: e. f!"), "SQP, 80 (a+b)/c = 1; d: e. f!");
}

TEST(LatexText, CharactersThatAFontJoinsStayApart) {
  EXPECT_EQ(LatexText("x -- y --- z"), "x -{}- y -{}-{}- z");
  EXPECT_EQ(LatexText("''a'' ``b``"), "'{}'a'{}' `{}`b`{}`");
  EXPECT_EQ(LatexText(",,a,,"), ",{},a,{},");
  EXPECT_EQ(LatexText("?`!`"), "?{}`!{}`");
  EXPECT_EQ(LatexText("<<a>>"), "\\textless{}\\textless{}a\\textgreater{}\\textgreater{}");
}

TEST(LatexText, ARowsEndDoesNotTakeACellForItsArgument) {
  EXPECT_EQ(LatexText("[x]"), "{}[x]");
  EXPECT_EQ(LatexText("*x"), "{}*x");
  EXPECT_EQ(LatexText("a[x]*"), "a[x]*");
}

TEST(LatexText, PackagesThatItNeedsAreNamed) {
  EXPECT_EQ(LatexNeeds("plain"), "% needs \\usepackage{booktabs}\n");
  EXPECT_THAT(LatexNeeds(LatexText("\"a\"")), HasSubstr("\\usepackage[T1]{fontenc}"));
  EXPECT_THAT(LatexNeeds("Größe"), HasSubstr("% needs utf8"));
}

TEST(MarkdownText, WhatFormatsOrIsHtmlIsEscaped) {
  EXPECT_EQ(MarkdownText("<img src=x onerror=y>"), "&lt;img src=x onerror=y&gt;");
  EXPECT_EQ(MarkdownText("a|b`c`&amp;"), "a\\|b\\`c\\`&amp;amp;");
  EXPECT_EQ(MarkdownText("[a](javascript:b)"), "\\[a\\](javascript:b)");
  EXPECT_EQ(MarkdownText("a\\|b"), "a\\\\\\|b");
  EXPECT_EQ(MarkdownText("multi_starts 80 % *"), "multi_starts 80 % *");
}

TEST(MarkdownText, ListingsUseIt) {
  Listing listing;
  listing.columns = {"<b>"};
  listing.rows = {{"<i>|"}};
  const std::string text = RenderListing(listing, TableFormat::kMarkdown);
  EXPECT_THAT(text, HasSubstr("| &lt;b&gt; |"));
  EXPECT_THAT(text, HasSubstr("| &lt;i&gt;\\| |"));
  EXPECT_THAT(text, Not(HasSubstr("<")));
}

TEST(Columns, AColumnMayHaveACommaInItsName) {
  Listing listing;
  listing.columns = {"a,b", "a", "c"};
  listing.rows = {{1, 2, 3}};
  const auto kept = [&](const std::vector<std::string>& columns) {
    std::vector<std::string> names;
    for (const TableColumn& column : KeepColumns(TableOf(listing), columns).columns) names.push_back(column.name);
    return names;
  };
  EXPECT_EQ(kept({"a,b"}), (std::vector<std::string>{"a,b"}));
  EXPECT_EQ(kept({"a,c", "a,b"}), (std::vector<std::string>{"a", "c", "a,b"}));
  EXPECT_EQ(kept({"c,a,b"}), (std::vector<std::string>{"c", "a,b"}));
}

}  // namespace
}  // namespace legopt::client
