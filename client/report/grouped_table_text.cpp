#include <algorithm>

#include "client/report/grouped_table.h"

namespace legopt::client {
namespace {

constexpr std::size_t kBarGap = 3;          // " | "
constexpr std::size_t kNarrowestName = 20;  // row names are not broken into shorter pieces

// Which groups are side by side.
enum class Stacking { kNone, kBySection, kByGroup };

// A possible layout of a table.
struct Arrangement {
  bool brief;
  Stacking stacking;
};

// Ordered from the most to the least detailed layout.
constexpr Arrangement kArrangements[] = {{false, Stacking::kNone},      {true, Stacking::kNone},
                                         {false, Stacking::kBySection}, {true, Stacking::kBySection},
                                         {false, Stacking::kByGroup},   {true, Stacking::kByGroup}};

struct GroupedCell {
  std::string text;
  Emphasis emphasis = Emphasis::kNone;
};

// A table with some of the groups, rendered as a block of lines.
struct GroupedGrid {
  std::string title;               // shown above it; empty: none
  std::vector<std::string> heads;  // titles of the groups, if `has_heads`
  bool has_heads = true;
  std::vector<std::vector<GroupedCell>> lines;  // the first line contains the column titles
};

using Widths = std::vector<std::size_t>;

std::string Choose(const TableText& text, bool brief) { return brief ? text.shortest() : text.full; }

std::string TitleOf(const TableGroup& group, bool brief) {
  return Choose(group.section, brief) + ", " + Choose(group.title, brief);
}

// Returns the groups of each grid.
std::vector<std::vector<std::size_t>> Parts(const GroupedTable& table, Stacking stacking) {
  std::vector<std::vector<std::size_t>> parts;
  for (std::size_t i = 0; i < table.groups.size(); ++i) {
    const bool joins =
        !parts.empty() &&
        (stacking == Stacking::kNone ||
         (stacking == Stacking::kBySection && table.groups[i].section.full == table.groups[i - 1].section.full));
    if (!joins) parts.emplace_back();
    parts.back().push_back(i);
  }
  if (parts.empty()) parts.emplace_back();
  return parts;
}

void AddHeads(const GroupedTable& table, const std::vector<std::size_t>& groups, const Arrangement& arrangement,
              GroupedGrid* grid) {
  if (groups.empty()) return;
  grid->has_heads = arrangement.stacking != Stacking::kByGroup;
  const TableGroup& first = table.groups[groups.front()];
  if (arrangement.stacking == Stacking::kBySection) grid->title = first.section.full;
  if (arrangement.stacking == Stacking::kByGroup) grid->title = TitleOf(first, false);
  for (const std::size_t group : groups) {
    const TableGroup& titles = table.groups[group];
    grid->heads.push_back(arrangement.stacking == Stacking::kNone ? TitleOf(titles, arrangement.brief)
                                                                  : titles.title.full);
  }
}

GroupedGrid GridOf(const GroupedTable& table, const std::vector<std::size_t>& groups, const Arrangement& arrangement) {
  const std::size_t keys = table.key_titles.size(), columns = table.column_titles.size();
  const auto cell = [&](const TableText& text) { return GroupedCell{Choose(text, arrangement.brief), text.emphasis}; };
  GroupedGrid grid;
  AddHeads(table, groups, arrangement, &grid);
  auto& titles = grid.lines.emplace_back();
  for (const auto& title : table.key_titles) titles.push_back(cell(title));
  for (std::size_t i = 0; i < groups.size(); ++i) {
    for (const auto& title : table.column_titles) titles.push_back(cell(title));
  }
  for (const auto& row : table.rows) {
    auto& line = grid.lines.emplace_back();
    for (std::size_t i = 0; i < keys; ++i) line.push_back(cell(row[i]));
    for (const std::size_t group : groups) {
      for (std::size_t i = 0; i < columns; ++i) line.push_back(cell(row[keys + group * columns + i]));
    }
  }
  return grid;
}

// Positions of a grid's columns.
class Geometry {
 public:
  Geometry(std::size_t keys, std::size_t columns, Widths widths)
      : keys_(keys), columns_(columns), widths_(std::move(widths)) {}

  bool group_starts(std::size_t column) const { return column >= keys_ && (column - keys_) % columns_ == 0; }
  std::size_t width(std::size_t column) const { return widths_[column]; }
  std::size_t group_width(std::size_t group) const { return Span(keys_ + group * columns_, columns_); }
  std::size_t keys_width() const { return Span(0, keys_); }

  std::size_t total() const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < widths_.size(); ++i)
      sum += widths_[i] + (i == 0 ? 0 : group_starts(i) ? kBarGap : kColumnGap);
    return sum;
  }

  // Widens the columns of a group evenly for a long title.
  void MakeRoom(const std::vector<std::string>& heads) {
    for (std::size_t group = 0; group < heads.size(); ++group) {
      const std::size_t head = DisplayWidth(heads[group]);
      for (std::size_t width = group_width(group); width < head; ++width) {
        ++widths_[keys_ + group * columns_ + width % columns_];
      }
    }
  }

  // Narrows the name column until the grid fits. Returns false if that is not sufficient.
  bool Fit(std::size_t limit) {
    if (limit == 0 || total() <= limit) return true;
    const std::size_t excess = total() - limit, name = widths_.front();
    if (name < excess || name - excess < std::min(name, kNarrowestName)) return false;
    widths_.front() -= excess;
    return true;
  }

 private:
  std::size_t Span(std::size_t first, std::size_t count) const {
    std::size_t width = (count - 1) * kColumnGap;
    for (std::size_t i = first; i < first + count; ++i) width += widths_[i];
    return width;
  }

  std::size_t keys_, columns_;
  Widths widths_;
};

// Returns column widths for all grids with as many columns as `shape`.
Geometry GeometryOf(const GroupedTable& table, const std::vector<GroupedGrid>& grids, const GroupedGrid& shape) {
  const std::size_t num_columns = shape.lines.front().size();
  const auto has_shape = [&](const GroupedGrid& grid) { return grid.lines.front().size() == num_columns; };
  Widths widths(num_columns, 0);
  for (const auto& grid : grids) {
    if (!has_shape(grid)) continue;
    for (const auto& line : grid.lines) {
      for (std::size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], DisplayWidth(line[i].text));
    }
  }
  Geometry geometry(table.key_titles.size(), table.column_titles.size(), std::move(widths));
  for (const auto& grid : grids) {
    if (has_shape(grid) && grid.has_heads) geometry.MakeRoom(grid.heads);
  }
  return geometry;
}

std::string Trimmed(std::string line) { return line.erase(line.find_last_not_of(' ') + 1); }

std::string Centered(const std::string& text, std::size_t width) {
  const std::size_t length = std::min(DisplayWidth(text), width);
  const std::size_t left = (width - length) / 2;
  return std::string(left, ' ') + text + std::string(width - left - length, ' ');
}

std::string HeadLine(const GroupedGrid& grid, const Geometry& geometry) {
  std::string line(geometry.keys_width(), ' ');
  for (std::size_t group = 0; group < grid.heads.size(); ++group) {
    line += " | " + Centered(grid.heads[group], geometry.group_width(group));
  }
  return Trimmed(line) + "\n";
}

// Renders a row; a name that is too long for its column is wrapped.
std::string RowLines(const std::vector<GroupedCell>& cells, const Geometry& geometry, bool color) {
  const auto names = WrapText(cells.front().text, geometry.width(0));
  std::string text;
  for (std::size_t part = 0; part < names.size(); ++part) {
    std::string line;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::string shown = i == 0 ? names[part] : part == 0 ? cells[i].text : "";
      const std::string padding(geometry.width(i) - DisplayWidth(shown), ' ');
      const std::string emphasized = Emphasized(shown, cells[i].emphasis, color);
      if (i > 0) line += geometry.group_starts(i) ? " | " : std::string(kColumnGap, ' ');
      line += i == 0 ? emphasized + padding : padding + emphasized;
    }
    text += Trimmed(line) + "\n";
  }
  return text;
}

std::string RenderGrid(const GroupedGrid& grid, const Geometry& geometry, const TextLayout& layout) {
  std::string text = grid.title.empty() ? "" : Paragraph(grid.title, layout, Emphasis::kBest);
  if (grid.has_heads) text += HeadLine(grid, geometry);
  const std::string titles = RowLines(grid.lines.front(), geometry, false);
  std::string rule = titles.substr(0, titles.find('\n'));
  for (char& c : rule) c = c == '|' ? '+' : '-';
  text += titles + rule + "\n";
  for (std::size_t i = 1; i < grid.lines.size(); ++i) text += RowLines(grid.lines[i], geometry, layout.color);
  return text;
}

// Renders the table in one layout; empty if it is too wide.
std::string Arrange(const GroupedTable& table, const Arrangement& arrangement, const TextLayout& layout) {
  std::vector<GroupedGrid> grids;
  for (const auto& part : Parts(table, arrangement.stacking)) grids.push_back(GridOf(table, part, arrangement));
  std::string text;
  for (const auto& grid : grids) {
    Geometry geometry = GeometryOf(table, grids, grid);
    if (!geometry.Fit(layout.width)) return {};
    text += "\n" + RenderGrid(grid, geometry, layout);
  }
  return text;
}

std::string Labelled(const std::vector<TableText>& titles, const std::vector<TableText>& row, std::size_t first,
                     std::size_t from) {
  std::string text;
  for (std::size_t i = from; i < titles.size(); ++i) {
    text += (text.empty() ? "" : ", ") + titles[i].full + " " + row[first + i].full;
  }
  return text;
}

std::string Indented(const std::string& text, const TextLayout& layout) {
  std::string lines;
  for (const auto& line : WrapText(text, layout.width - kColumnGap))
    lines += std::string(kColumnGap, ' ') + line + "\n";
  return lines;
}

// Renders one paragraph per row, for widths in which no columns fit.
std::string RenderParagraphs(const GroupedTable& table, const TextLayout& layout) {
  const std::size_t keys = table.key_titles.size(), columns = table.column_titles.size();
  std::string text;
  for (const auto& row : table.rows) {
    text += "\n" + Paragraph(row.front().full, layout, Emphasis::kBest);
    text += Indented(Labelled(table.key_titles, row, 0, 1), layout);
    for (std::size_t group = 0; group < table.groups.size(); ++group) {
      text += Paragraph(TitleOf(table.groups[group], false) + ":", layout);
      text += Indented(Labelled(table.column_titles, row, keys + group * columns, 0), layout);
    }
  }
  return text;
}

}  // namespace

std::string RenderText(const GroupedTable& table, const TextLayout& layout) {
  std::string body;
  bool brief = false;
  for (const auto& arrangement : kArrangements) {
    body = Arrange(table, arrangement, layout);
    brief = arrangement.brief && !body.empty();
    if (!body.empty()) break;
  }
  if (body.empty()) body = RenderParagraphs(table, layout);
  std::string text = table.caption.empty() ? "" : Paragraph(table.caption, layout, Emphasis::kDim);
  text += body + "\n";
  if (brief && !table.legend.empty()) text += Paragraph(table.legend, layout, Emphasis::kDim);
  text += Paragraph(table.note, layout, Emphasis::kDim);
  return text + (table.warning.empty() ? "" : Paragraph(table.warning, layout, Emphasis::kBad));
}

}  // namespace legopt::client
