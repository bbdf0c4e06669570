// What text of files may do to a terminal: nothing.
#include "base/printable.h"
#include "base/files/json.h"

#include <gtest/gtest.h>

namespace flexel {
namespace {

TEST(Printable, LettersOfEveryLanguageStay) {
  for (const std::string text :
       {"", "plain", "Ger\xc3\xa4t \xe9\x83\xa8\xe5\x93\x81 \xf0\x9f\x94\xa9", "a\\b"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, WhatActsOnATerminalIsWritten) {
  EXPECT_EQ(printable("a\x1b[31mb"), "a\\x1b[31mb");
  EXPECT_EQ(printable("a\nb\rc\td\x7f"), "a\\x0ab\\x0dc\\x09d\\x7f");
  EXPECT_EQ(printable(std::string_view("\0", 1)), "\\x00");
  EXPECT_EQ(printable("\xc2\x9b"), "\\u009b");
  EXPECT_EQ(printable("\xe2\x80\xae\xe2\x81\xa6\xd8\x9c"), "\\u202e\\u2066\\u061c");
}

TEST(Printable, BytesThatAreNoUtf8AreWritten) {
  EXPECT_EQ(printable("\xe9t\xff"), "\\xe9t\\xff");
  EXPECT_EQ(printable("\xc3"), "\\xc3");                    // cut off
  EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf");           // longer than it needs to be
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");  // half of a pair
}

TEST(Printable, EndsOfLinesStayWhereThereAreSeveral) {
  EXPECT_EQ(printable_lines("a\x1b\nb\n\nc\n"), "a\\x1b\nb\n\nc\n");
}

TEST(JsonDepth, CountsBracketsOutsideOfStrings) {
  EXPECT_EQ(json_depth(""), 0u);
  EXPECT_EQ(json_depth("1"), 0u);
  EXPECT_EQ(json_depth(R"([{"a": [1]}, []])"), 3u);
  EXPECT_EQ(json_depth(R"(["[[[\"[[", "\\", []])"), 2u);
  EXPECT_EQ(json_depth(std::string(1000, '[')), 1000u);
}

}  // namespace
}  // namespace flexel
