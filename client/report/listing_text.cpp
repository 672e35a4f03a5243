#include "client/report/listing_text.h"

#include <algorithm>
#include <numeric>

#include "app/printable.h"
#include "legopt/types/job.h"

namespace legopt::client {
namespace {

constexpr std::string_view kDead = ToString(JobState::kDead), kFailed = ToString(JobState::kFailed);

constexpr std::size_t kIndent = 4;          // indentation of continuation lines
constexpr std::size_t kMostLines = 3;       // per row
constexpr std::size_t kNarrowestText = 20;  // texts are not broken into shorter pieces

using Widths = std::vector<std::size_t>;

struct Cell {
  std::string text;
  Emphasis emphasis = Emphasis::kNone;
};

// A listing as displayed: the titles are the first line.
struct Grid {
  std::vector<std::vector<Cell>> lines;
  std::vector<bool> numeric;

  std::size_t num_columns() const { return numeric.size(); }
};

Emphasis EmphasisOf(const std::string& column, const nlohmann::json& value) {
  const bool count = (column == kDead || column == kFailed) && value.is_number() && value > 0;
  const bool state = column == "state" && (value == kDead || value == kFailed);
  return count || state ? Emphasis::kBad : Emphasis::kNone;
}

Grid GridOf(const Listing& listing) {
  Grid grid;
  grid.numeric = NumericColumns(listing);
  auto& titles = grid.lines.emplace_back();
  for (const auto& column : listing.columns) titles.push_back({app::Printable(column), Emphasis::kDim});
  for (const auto& row : listing.rows) {
    auto& line = grid.lines.emplace_back();
    for (std::size_t i = 0; i < row.size(); ++i) {
      line.push_back({ShownValue(row[i]), EmphasisOf(listing.columns[i], row[i])});
    }
  }
  return grid;
}

Widths NaturalWidths(const Grid& grid) {
  Widths widths(grid.num_columns(), 0);
  for (const auto& line : grid.lines) {
    for (std::size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], DisplayWidth(line[i].text));
  }
  return widths;
}

std::size_t Total(const Widths& widths) {
  return std::accumulate(widths.begin(), widths.end(), std::size_t{0}) +
         (widths.empty() ? 0 : widths.size() - 1) * kColumnGap;
}

// Renders some of the columns: one line per row unless a text is wrapped.
std::string RowLines(const std::vector<Cell>& line, const Grid& grid, const Widths& widths, bool color) {
  std::vector<std::vector<std::string>> pieces;
  std::size_t height = 1;
  for (std::size_t i = 0; i < line.size(); ++i) {
    pieces.push_back(WrapText(line[i].text, widths[i]));
    height = std::max(height, pieces.back().size());
  }
  std::string text;
  for (std::size_t part = 0; part < height; ++part) {
    std::string row;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const std::string piece = part < pieces[i].size() ? pieces[i][part] : "";
      const std::string padding(widths[i] - std::min(DisplayWidth(piece), widths[i]), ' ');
      const std::string shown = Emphasized(piece, line[i].emphasis, color);
      row += (i > 0 ? std::string(kColumnGap, ' ') : "") + (grid.numeric[i] ? padding + shown : shown + padding);
    }
    row.erase(row.find_last_not_of(' ') + 1);
    text += row + "\n";
  }
  return text;
}

std::string RenderAligned(const Grid& grid, const Widths& widths, bool color) {
  std::string text;
  for (const auto& line : grid.lines) text += RowLines(line, grid, widths, color);
  return text;
}

Grid Columns(const Grid& grid, const std::vector<std::size_t>& columns) {
  Grid part;
  for (const std::size_t i : columns) part.numeric.push_back(grid.numeric[i]);
  for (const auto& line : grid.lines) {
    auto& kept = part.lines.emplace_back();
    for (const std::size_t i : columns) kept.push_back(line[i]);
  }
  return part;
}

// Removes columns with equal values in all rows from the grid and returns a sentence about them; the first column
// stays.
std::string ExtractConstantColumns(Grid* grid) {
  constexpr std::size_t kFewestLines = 3;  // titles and two rows
  if (grid->lines.size() < kFewestLines) return {};
  std::vector<std::size_t> varying;
  std::string text;
  for (std::size_t i = 0; i < grid->num_columns(); ++i) {
    const std::string& value = grid->lines[1][i].text;
    const bool constant = std::all_of(grid->lines.begin() + 1, grid->lines.end(),
                                      [&](const auto& line) { return line[i].text == value; });
    if (i == 0 || !constant) {
      varying.push_back(i);
    } else {
      text += (text.empty() ? "In all rows: " : ", ") + grid->lines[0][i].text + " " + value;
    }
  }
  *grid = Columns(*grid, varying);
  return text;
}

// Narrows the widest texts until all columns fit side by side. Returns an empty vector if that is not sufficient.
Widths ShrinkTextColumns(const Grid& grid, Widths widths, std::size_t limit) {
  while (Total(widths) > limit) {
    std::size_t widest = widths.size();
    for (std::size_t i = 0; i < widths.size(); ++i) {
      const std::size_t smallest = std::max(kNarrowestText, DisplayWidth(grid.lines[0][i].text));
      if (grid.numeric[i] || widths[i] <= smallest) continue;
      if (widest == widths.size() || widths[i] > widths[widest]) widest = i;
    }
    if (widest == widths.size()) return {};
    --widths[widest];
  }
  return widths;
}

using Bands = std::vector<std::vector<std::size_t>>;

// Distributes the columns of a row to lines in order, as many as fit on each; empty if there are too many lines.
Bands FoldGreedily(const Grid& grid, const Widths& natural, std::size_t limit) {
  Bands bands(1);
  std::size_t used = 0;
  for (std::size_t i = 0; i < natural.size(); ++i) {
    const std::size_t title = DisplayWidth(grid.lines[0][i].text);
    const std::size_t width = grid.numeric[i] ? natural[i] : std::min(natural[i], std::max(kNarrowestText, title));
    if (!bands.back().empty() && used + kColumnGap + width > limit) bands.emplace_back();
    used = bands.back().empty() ? width + (bands.size() > 1 ? kIndent : 0) : used + kColumnGap + width;
    bands.back().push_back(i);
    if (used > limit || bands.size() > kMostLines) return {};
  }
  return bands;
}

// Distributes the columns to the same number of lines with similar lengths.
Bands Fold(const Grid& grid, const Widths& natural, std::size_t limit) {
  Bands bands = FoldGreedily(grid, natural, limit);
  if (bands.empty()) return bands;
  for (std::size_t shorter = limit - 1; shorter > 0; --shorter) {
    Bands balanced = FoldGreedily(grid, natural, shorter);
    if (balanced.size() != bands.size()) break;
    bands = std::move(balanced);
  }
  return bands;
}

std::string Indented(const std::string& lines) {
  std::string text;
  for (std::size_t at = 0; at < lines.size();) {
    const std::size_t end = lines.find('\n', at) + 1;
    text += std::string(kIndent, ' ') + lines.substr(at, end - at);
    at = end;
  }
  return text;
}

std::string RenderFolded(const Grid& grid, const Bands& bands, const TextLayout& layout) {
  std::vector<Grid> parts;
  std::vector<Widths> widths;
  for (const auto& band : bands) {
    parts.push_back(Columns(grid, band));
    widths.push_back(
        ShrinkTextColumns(parts.back(), NaturalWidths(parts.back()), layout.width - (parts.size() > 1 ? kIndent : 0)));
  }
  std::string text;
  for (std::size_t line = 0; line < grid.lines.size(); ++line) {
    for (std::size_t band = 0; band < bands.size(); ++band) {
      const std::string lines = RowLines(parts[band].lines[line], parts[band], widths[band], layout.color);
      text += band == 0 ? lines : Indented(lines);
    }
  }
  return text;
}

// Renders "name  value"; if the width is too small, the value is on the next line.
std::string FieldLines(const std::string& name, std::size_t name_width, const Cell& value, const TextLayout& layout) {
  const bool beside = layout.width == 0 || name_width + kColumnGap + kNarrowestText <= layout.width;
  const std::size_t indent = beside ? name_width + kColumnGap : kColumnGap;
  std::string text;
  if (!beside) text = Paragraph(name, layout);
  bool first = beside;
  for (auto& line : WrapText(value.text, layout.width == 0 ? 0 : layout.width - indent)) {
    const std::size_t padding = first ? indent - DisplayWidth(name) : indent;
    text += (first ? name : "") + std::string(padding, ' ') +
            Emphasized(std::move(line), value.emphasis, layout.color) + "\n";
    first = false;
  }
  return text;
}

std::string RenderRow(const Grid& grid, std::size_t line, const TextLayout& layout) {
  std::size_t name_width = 0;
  for (const auto& title : grid.lines[0]) name_width = std::max(name_width, DisplayWidth(title.text));
  std::string text;
  for (std::size_t i = 0; i < grid.num_columns(); ++i) {
    text += FieldLines(grid.lines[0][i].text, name_width, grid.lines[line][i], layout);
  }
  return text;
}

std::string RenderRows(const Grid& grid, const TextLayout& layout) {
  if (grid.lines.size() == 1) {
    std::string text;
    for (const auto& title : grid.lines[0]) text += Paragraph(title.text, layout, title.emphasis);
    return text;
  }
  std::string text;
  for (std::size_t line = 1; line < grid.lines.size(); ++line) {
    text += (line > 1 ? "\n" : "") + RenderRow(grid, line, layout);
  }
  return text;
}

std::string RenderNarrow(Grid grid, const TextLayout& layout) {
  const std::string constants = ExtractConstantColumns(&grid);
  const std::string head = constants.empty() ? "" : Paragraph(constants, layout, Emphasis::kDim) + "\n";
  const Widths natural = NaturalWidths(grid);
  if (const Widths widths = ShrinkTextColumns(grid, natural, layout.width); !widths.empty()) {
    return head + RenderAligned(grid, widths, layout.color);
  }
  constexpr std::size_t kFewestLines = 3;  // a single row is clearer with one value per line
  const auto bands =
      grid.lines.size() < kFewestLines ? std::vector<std::vector<std::size_t>>() : Fold(grid, natural, layout.width);
  return head + (bands.empty() ? RenderRows(grid, layout) : RenderFolded(grid, bands, layout));
}

}  // namespace

std::string RenderListingText(const Listing& listing, const TextLayout& layout) {
  Grid grid = GridOf(listing);
  const Widths widths = NaturalWidths(grid);
  if (layout.width == 0 || Total(widths) <= layout.width) return RenderAligned(grid, widths, layout.color);
  return RenderNarrow(std::move(grid), layout);
}

std::string RenderFields(const Listing& listing, std::size_t row, const TextLayout& layout) {
  Listing kept;
  kept.rows.emplace_back();
  for (std::size_t i = 0; i < listing.columns.size(); ++i) {
    const auto& value = listing.rows.at(row)[i];
    if (value.is_null() || (value.is_string() && value.get<std::string>().empty())) continue;
    kept.columns.push_back(listing.columns[i]);
    kept.rows.front().push_back(value);
  }
  return kept.columns.empty() ? "" : RenderRow(GridOf(kept), 1, layout);
}

std::string AlignColumns(std::span<const std::vector<std::string>> lines, const std::vector<bool>& right_aligned) {
  Grid grid;
  grid.numeric = right_aligned;
  for (const auto& line : lines) {
    auto& cells = grid.lines.emplace_back();
    for (const auto& text : line) cells.push_back({text});
  }
  return RenderAligned(grid, NaturalWidths(grid), false);
}

std::string AlignSentences(std::span<const std::vector<std::string>> lines, std::size_t width) {
  if (lines.empty()) return "";
  const std::size_t last = lines.front().size() - 1;
  std::size_t indent = 0;
  for (std::size_t column = 0; column < last; ++column) {
    std::size_t widest = 0;
    for (const auto& line : lines) widest = std::max(widest, DisplayWidth(line[column]));
    indent += widest + kColumnGap;
  }
  const std::size_t room = width == 0 ? 0 : std::max(width - std::min(width, indent), width / 2);
  std::vector<std::vector<std::string>> broken;
  for (const auto& line : lines) {
    std::vector<std::string> cells = line;
    for (const std::string& part : WrapText(line[last], room)) {
      cells[last] = part;
      broken.push_back(cells);
      cells.assign(last + 1, "");
    }
  }
  return AlignColumns(broken, std::vector<bool>(last + 1, false));
}

}  // namespace legopt::client
