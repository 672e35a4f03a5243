// Policy: letters of every script are preserved. Characters that control a terminal, hide text or reorder it are
// escaped anywhere in a text.
#include "app/printable.h"

#include <gtest/gtest.h>

#include <string>

namespace legopt::app {
namespace {

TEST(Printable, LettersStay) {
  const std::string text = "Größe 50 % & co — 実験 №1 \\n \xF0\x9F\xA4\x96";
  EXPECT_EQ(Printable(text), text);
  EXPECT_EQ(Printable(""), "");
}

TEST(Printable, ControlsBecomeVisible) {
  EXPECT_EQ(Printable("a\x1b[31mred\x1b]0;title\x07z"), "a\\x1b[31mred\\x1b]0;title\\x07z");
  EXPECT_EQ(Printable("one\ntwo\tthree\r"), "one\\ntwo\\tthree\\r");
  EXPECT_EQ(Printable(std::string("nul\0.", 5)), "nul\\x00.");
  EXPECT_EQ(Printable("\x7f"), "\\x7f");
}

TEST(Printable, EveryControlOfAsciiAndLatin) {
  for (int code = 0; code < 0x20; ++code) {
    const std::string out = Printable(std::string(1, static_cast<char>(code)));
    EXPECT_EQ(out[0], '\\') << code;
    EXPECT_EQ(out.find_first_not_of("\\abcdefnrtux0123456789"), std::string::npos) << code;
  }
  for (int code = 0x80; code < 0xA0; ++code) {
    const std::string out = Printable(std::string("\xC2") + static_cast<char>(code));
    EXPECT_EQ(out.rfind("\\u00", 0), 0U) << code;
  }
}

TEST(Printable, NothingHidesOrReorders) {
  EXPECT_EQ(Printable("\u202Egnp.exe"), "\\u202egnp.exe");   // override
  EXPECT_EQ(Printable("\u2066x\u2069"), "\\u2066x\\u2069");  // isolates
  EXPECT_EQ(Printable("a\u200Bb\u2028c\uFEFF"), "a\\u200bb\\u2028c\\ufeff");
  EXPECT_EQ(Printable("\U000E0041"), "\\ue0041");
}

TEST(Printable, BrokenUtf8IsShownByteByByte) {
  EXPECT_EQ(Printable("\x9b"
                      "31m"),
            "\\x9b31m");                           // an 8-bit CSI
  EXPECT_EQ(Printable("\xC3"), "\\xc3");           // cut off
  EXPECT_EQ(Printable("\xC0\x8A"), "\\xc0\\x8a");  // overlong newline
  EXPECT_EQ(Printable("\xE0\x80\x9B"), "\\xe0\\x80\\x9b");
  EXPECT_EQ(Printable("\xED\xA0\x80"), "\\xed\\xa0\\x80");           // a surrogate
  EXPECT_EQ(Printable("\xF4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // beyond Unicode
  EXPECT_EQ(Printable("\xC3(ü"), "\\xc3(ü");
}

TEST(PrintableLines, KeepsLinesAndNothingElse) {
  EXPECT_EQ(PrintableLines("a\tb\r\n\x1b[2Jc\n"), "a b\n\\x1b[2Jc\n");
  EXPECT_EQ(PrintableLines("\r\r\n\n"), "\\r\n\n");
  EXPECT_EQ(PrintableLines(""), "");
}

}  // namespace
}  // namespace legopt::app
