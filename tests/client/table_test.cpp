// Policy: one table in all five formats. Text, Markdown and LaTeX show the same texts; CSV and JSON have exact values.
#include "client/report/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "client/client_error.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

// Returns a table with all types of cells, two groups of columns and two groups of rows.
Table Example() {
  Table table;
  table.title = {"Times of table_1"};
  table.columns = {{"method", "Method", "", Alignment::kLeft},
                   {"starts"},
                   {"good_success", "Success", "", Alignment::kRight, "Good"},
                   {"good_time", "Time", "us", Alignment::kRight, "Good"},
                   {"hard_success", "Success", "", Alignment::kRight, "In collision"},
                   {"hard_time", "Time", "us", Alignment::kRight, "In collision"}};
  table.rows = {{{TextCell("SQP"), CountCell(0), SuccessCell(34, 35), RealCell(1.2345, 2), SuccessCell(0, 35, "1 dead"),
                  RealCell(std::nullopt, 2)},
                 "Ours"},
                {{TextCell("a|b & c"), CountCell(10), MissingCell("not run"), FigureCell(INFINITY, "inf"),
                  PercentCell(0.5, 1), MissingCell()},
                 "Theirs"}};
  table.notes = {{"Means of 100 % of them."}, {"A warning.", Emphasis::kBad}};
  return table;
}

TEST(Table, Text) {
  EXPECT_EQ(RenderTable(Example(), TableFormat::kText), R"(Times of table_1

                |        Good        |       In collision
Method   starts | Success  Time (us) |       Success  Time (us)
----------------+--------------------+-------------------------

Ours
SQP           0 |   34/35       1.23 | 0/35 (1 dead)          -

Theirs
a|b & c      10 | not run        inf |          50.0          -

Means of 100 % of them.
A warning.
)");
}

TEST(Table, TextStacked) {
  EXPECT_EQ(RenderTable(Example(), TableFormat::kText, {40, false}), R"(Times of table_1

Ours
Method       SQP
starts       0
Good
  Success    34/35
  Time (us)  1.23
In collision
  Success    0/35 (1 dead)
  Time (us)  -

Theirs
Method       a|b & c
starts       10
Good
  Success    not run
  Time (us)  inf
In collision
  Success    50.0
  Time (us)  -

Means of 100 % of them.
A warning.
)");
}

TEST(Table, Markdown) {
  EXPECT_EQ(RenderTable(Example(), TableFormat::kMarkdown), R"(**Times of table_1**

**Ours**

| Method | starts | Good: success | time (us) | In collision: success | time (us) |
| --- | ---: | ---: | ---: | ---: | ---: |
| SQP | 0 | 34/35 | 1.23 | 0/35 (1 dead) | - |

**Theirs**

| Method | starts | Good: success | time (us) | In collision: success | time (us) |
| --- | ---: | ---: | ---: | ---: | ---: |
| a\|b &amp; c | 10 | not run | inf | 50.0 | - |

Means of 100 % of them.

A warning.
)");
}

TEST(Table, Latex) {
  EXPECT_EQ(RenderTable(Example(), TableFormat::kLatex), R"(% needs \usepackage{booktabs}
\begin{table*}
\centering
\caption{Times of table\_1}
\begin{tabular}{lrrrrr}
\toprule
\multicolumn{2}{c}{} & \multicolumn{2}{c}{Good} & \multicolumn{2}{c}{In collision} \\
\cmidrule(lr){3-4}\cmidrule(lr){5-6}
Method & starts & Success & Time ($\mu$s) & Success & Time ($\mu$s) \\
\midrule
\multicolumn{6}{l}{\textbf{Ours}} \\
SQP & 0 & 34/35 & 1.23 & 0/35 (1 dead) & -- \\
\multicolumn{6}{l}{\textbf{Theirs}} \\
a\textbar{}b \& c & 10 & not run & inf & 50.0 & -- \\
\bottomrule
\end{tabular}

\smallskip
Note: Means of 100 \% of them.

\smallskip
A warning.
\end{table*}
)");
}

TEST(Table, CsvAndJsonHaveExactValues) {
  EXPECT_EQ(RenderTable(Example(), TableFormat::kCsv),
            "method,starts,good_success,good_time,hard_success,hard_time\n"
            "SQP,0,34/35,1.2345,0/35 (1 dead),\n"
            "a|b & c,10,,inf,0.5,\n");
  const auto json = nlohmann::json::parse(RenderTable(Example(), TableFormat::kJson));
  EXPECT_EQ(json[0].at("good_time"), 1.2345);
  EXPECT_EQ(json[1].at("good_time"), "inf");
  EXPECT_TRUE(json[1].at("good_success").is_null());
}

TEST(Table, LastTextIsWrappedBeforeTheTableIsStacked) {
  Table table;
  table.has_headings = false;
  table.columns = {{"check", "", "", Alignment::kLeft}, {"message", "", "", Alignment::kLeft}};
  table.rows = {{{TextCell("winding"), TextCell("closed and wound outwards, without holes")}}};
  EXPECT_EQ(RenderTable(table, TableFormat::kText, {34, false}),
            "winding  closed and wound\n         outwards, without holes\n");
}

TEST(Table, UntrustedTextDoesNotControlTheTerminal) {
  Table table = Example();
  table.title = {"a\x1b[31m"};
  table.columns[2].group = "b\x1b[31m";
  table.rows[0].group = "c\x1b[31m";
  table.rows[0].cells[0] = TextCell("d\x1b[31m");
  table.notes = {{"e\x1b[31m"}};
  for (const auto format : {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kLatex}) {
    EXPECT_THAT(RenderTable(table, format), testing::Not(HasSubstr("\x1b")));
  }
}

TEST(Table, ColumnsAreChosenByNameOrByHeading) {
  const Table kept = KeepColumns(Example(), {"time,method"});
  EXPECT_EQ(RenderTable(kept, TableFormat::kCsv), "method,good_time,hard_time\nSQP,1.2345,\na|b & c,inf,\n");
  EXPECT_EQ(KeepColumns(Example(), {"hard_time"}).columns.size(), 1U);
  try {
    KeepColumns(Example(), {"methid"});
    FAIL();
  } catch (const ClientError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean 'method'?"));
  }
}

}  // namespace
}  // namespace legopt::client
