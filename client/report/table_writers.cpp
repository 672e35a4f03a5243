#include "client/report/table_writers.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>

#include "client/report/escaped_text.h"
#include "legopt/input/json.h"

namespace legopt::client {
namespace {

constexpr std::size_t kBarGap = 3;          // " | "
constexpr std::size_t kNarrowestText = 20;  // texts are not broken into shorter pieces

using Widths = std::vector<std::size_t>;

std::string Trimmed(std::string line) { return line.erase(line.find_last_not_of(' ') + 1); }

std::string Centered(const std::string& text, std::size_t width) {
  const std::size_t length = std::min(DisplayWidth(text), width);
  const std::size_t left = (width - length) / 2;
  return std::string(left, ' ') + text + std::string(width - left - length, ' ');
}

// Returns the width of adjacent columns with the gaps between them.
std::size_t Span(const ShownTable& shown, const Widths& widths, std::size_t first, std::size_t count) {
  std::size_t width = 0;
  for (std::size_t i = first; i < first + count; ++i) {
    width += widths[i] + (i == first ? 0 : shown.GroupBegins(i) ? kBarGap : kColumnGap);
  }
  return width;
}

Widths NaturalWidths(const ShownTable& shown) {
  const Table& table = shown.table;
  Widths widths(table.columns.size(), 0);
  for (std::size_t i = 0; i < widths.size(); ++i) {
    if (table.has_headings) widths[i] = DisplayWidth(shown.Heading(i));
    for (const TableRow& row : table.rows) widths[i] = std::max(widths[i], DisplayWidth(row.cells[i].shown));
  }
  // The columns of a group are widened evenly for a long heading.
  for (std::size_t i = 0; i < widths.size(); i += shown.GroupSize(i)) {
    const std::size_t columns = shown.GroupSize(i), head = DisplayWidth(table.columns[i].group);
    for (std::size_t width = Span(shown, widths, i, columns); width < head; ++width) ++widths[i + width % columns];
  }
  return widths;
}

// Narrows a left-aligned last column, whose text is then wrapped, until the table fits. Returns false if it cannot.
bool Fit(const ShownTable& shown, std::size_t limit, Widths* widths) {
  const std::size_t total = Span(shown, *widths, 0, widths->size());
  if (limit == 0 || total <= limit) return true;
  const std::size_t last = widths->size() - 1;
  const std::size_t others = total - widths->back();
  const std::size_t least = std::max(kNarrowestText, DisplayWidth(shown.Heading(last)));
  if (shown.table.columns[last].alignment == Alignment::kRight || others + least > limit) return false;
  widths->back() = limit - others;
  return true;
}

std::string GroupLine(const ShownTable& shown, const Widths& widths) {
  std::string line;
  for (std::size_t i = 0; i < widths.size(); i += shown.GroupSize(i)) {
    if (i > 0) line += " | ";
    line += Centered(shown.table.columns[i].group, Span(shown, widths, i, shown.GroupSize(i)));
  }
  return Trimmed(line) + "\n";
}

std::string RuleLine(const ShownTable& shown, const Widths& widths) {
  std::string line;
  for (std::size_t i = 0; i < widths.size(); ++i) {
    if (i > 0) line += shown.GroupBegins(i) ? "-+-" : std::string(kColumnGap, '-');
    line += std::string(widths[i], '-');
  }
  return line + "\n";
}

// Renders a row: one line unless the text of the last column is wrapped.
std::string RowLines(const ShownTable& shown, const std::vector<TableCell>& cells, const Widths& widths, bool color) {
  const auto last = WrapText(cells.back().shown, widths.back());
  std::string text;
  for (std::size_t part = 0; part < last.size(); ++part) {
    std::string line;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::string piece = i + 1 == cells.size() ? last[part] : part == 0 ? cells[i].shown : "";
      const std::string padding(widths[i] - std::min(DisplayWidth(piece), widths[i]), ' ');
      const std::string emphasized = Emphasized(piece, cells[i].emphasis, color);
      if (i > 0) line += shown.GroupBegins(i) ? " | " : std::string(kColumnGap, ' ');
      line += shown.table.columns[i].alignment == Alignment::kRight ? padding + emphasized : emphasized + padding;
    }
    text += Trimmed(line) + "\n";
  }
  return text;
}

std::string TextHeadingLines(const ShownTable& shown, const Widths& widths, bool color) {
  if (!shown.table.has_headings) return {};
  const bool grouped = shown.has_groups();
  std::vector<TableCell> headings;
  for (std::size_t i = 0; i < widths.size(); ++i) {
    headings.push_back({{}, shown.Heading(i), grouped ? Emphasis::kNone : Emphasis::kDim});
  }
  const std::string line = RowLines(shown, headings, widths, color);
  return grouped ? GroupLine(shown, widths) + line + RuleLine(shown, widths) : line;
}

std::string RenderWide(const ShownTable& shown, const Widths& widths, const TextLayout& layout) {
  std::string text = TextHeadingLines(shown, widths, layout.color), group;
  for (const TableRow& row : shown.table.rows) {
    if (row.group != group) {
      text += std::string(text.empty() ? "" : "\n") + Paragraph(row.group, layout, row.group_emphasis);
      group = row.group;
    }
    text += RowLines(shown, row.cells, widths, layout.color);
  }
  return text;
}

// Renders "name  value"; if the width is too small, the value is on the next line.
std::string FieldLines(const std::string& name, std::size_t name_width, const TableCell& value,
                       const TextLayout& layout) {
  const bool beside = layout.width == 0 || name_width + kColumnGap + kNarrowestText <= layout.width;
  const std::size_t indent = beside ? name_width + kColumnGap : kColumnGap;
  std::string text;
  if (!beside) text = Paragraph(name, layout);
  bool first = beside;
  for (auto& line : WrapText(value.shown, layout.width == 0 ? 0 : layout.width - indent)) {
    const std::size_t padding = first ? indent - DisplayWidth(name) : indent;
    text += (first ? name : "") + std::string(padding, ' ') +
            Emphasized(std::move(line), value.emphasis, layout.color) + "\n";
    first = false;
  }
  return text;
}

// Renders one line per value, below the headings of the groups; `keep` selects the columns.
template <class Keep>
std::string RenderBlock(const ShownTable& shown, const TableRow& row, const TextLayout& layout, const Keep& keep) {
  const auto name = [&](std::size_t i) {
    return (shown.table.columns[i].group.empty() ? "" : std::string(kColumnGap, ' ')) + shown.Heading(i);
  };
  std::size_t name_width = 0;
  for (std::size_t i = 0; i < row.cells.size(); ++i) {
    if (keep(row.cells[i])) name_width = std::max(name_width, DisplayWidth(name(i)));
  }
  std::string text;
  for (std::size_t i = 0; i < row.cells.size(); ++i) {
    if (!keep(row.cells[i])) continue;
    const std::string& group = shown.table.columns[i].group;
    if (!group.empty() && (i == 0 || shown.GroupBegins(i))) text += Paragraph(group, layout);
    text += FieldLines(name(i), name_width, row.cells[i], layout);
  }
  return text;
}

std::string RenderStacked(const ShownTable& shown, const TextLayout& layout) {
  std::string text, group;
  if (shown.table.rows.empty()) {
    for (std::size_t i = 0; i < shown.table.columns.size(); ++i) text += Paragraph(shown.Heading(i), layout);
  }
  for (const TableRow& row : shown.table.rows) {
    if (!text.empty()) text += "\n";
    if (row.group != group) text += Paragraph(row.group, layout, row.group_emphasis);
    group = row.group;
    text += RenderBlock(shown, row, layout, [](const TableCell& /*cell*/) { return true; });
  }
  return text;
}

}  // namespace

std::string RenderTableText(const ShownTable& shown, const TextLayout& layout) {
  const Table& table = shown.table;
  std::string text;
  for (const std::string& paragraph : table.title) text += Paragraph(paragraph, layout, Emphasis::kDim);
  if (!text.empty()) text += "\n";
  if (Widths widths = NaturalWidths(shown); !widths.empty()) {
    text += Fit(shown, layout.width, &widths) ? RenderWide(shown, widths, layout) : RenderStacked(shown, layout);
  }
  if (!table.notes.empty()) text += "\n";
  for (const TableNote& note : table.notes) text += Paragraph(note.text, layout, note.emphasis);
  return text;
}

std::string RenderRecord(const Table& table, std::size_t row, const TextLayout& layout) {
  const ShownTable shown(table);
  const auto has_value = [](const TableCell& cell) {
    return !cell.value.is_null() &&
           !(cell.value.is_string() && cell.value.template get_ref<const std::string&>().empty());
  };
  return RenderBlock(shown, shown.table.rows.at(row), layout, has_value);
}

namespace {

// Abbreviations such as PAR10 or CPU are not changed.
std::string Uncapitalized(std::string text) {
  if (text.size() > 1 && std::isupper(static_cast<unsigned char>(text[1])) != 0) return text;
  if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

std::string MarkdownHeadingLines(const ShownTable& shown) {
  std::string text = "|", rule = "|";
  for (std::size_t i = 0; i < shown.table.columns.size(); ++i) {
    const TableColumn& column = shown.table.columns[i];
    std::string heading = shown.Heading(i);
    if (!column.group.empty()) {
      heading = Uncapitalized(std::move(heading));
      if (i == 0 || shown.GroupBegins(i)) heading = column.group + ": " + heading;
    }
    text += " " + MarkdownText(heading) + " |";
    rule += column.alignment == Alignment::kRight ? " ---: |" : " --- |";
  }
  return text + "\n" + rule + "\n";
}

}  // namespace

std::string RenderTableMarkdown(const ShownTable& shown) {
  const Table& table = shown.table;
  const std::string headings = MarkdownHeadingLines(shown);
  const std::string mark = table.title.size() == 1 ? "**" : "";
  std::string text;
  for (const std::string& paragraph : table.title) text += mark + MarkdownText(paragraph) + mark + "\n\n";
  if (table.rows.empty() || table.rows.front().group.empty()) text += headings;
  std::string group;
  for (const TableRow& row : table.rows) {
    if (row.group != group) {
      text += std::string(group.empty() ? "" : "\n") + "**" + MarkdownText(row.group) + "**\n\n" + headings;
      group = row.group;
    }
    text += "|";
    for (const TableCell& cell : row.cells) text += " " + MarkdownText(cell.shown) + " |";
    text += "\n";
  }
  for (const TableNote& note : table.notes) text += "\n" + MarkdownText(note.text) + "\n";
  return text;
}

namespace {

std::string LatexLine(const std::vector<std::string>& cells) {
  std::string text;
  for (std::size_t i = 0; i < cells.size(); ++i) text += (i == 0 ? "" : " & ") + cells[i];
  return text + " \\\\\n";
}

std::string Spanning(std::size_t columns, const std::string& alignment, const std::string& text) {
  return "\\multicolumn{" + std::to_string(columns) + "}{" + alignment + "}{" + text + "}";
}

// Renders the headings of the groups and the rules below them.
std::string LatexGroups(const ShownTable& shown) {
  std::vector<std::string> groups;
  std::string rules;
  for (std::size_t i = 0; i < shown.table.columns.size(); i += shown.GroupSize(i)) {
    const std::string& group = shown.table.columns[i].group;
    groups.push_back(Spanning(shown.GroupSize(i), "c", LatexText(group)));
    if (group.empty()) continue;
    rules += "\\cmidrule(lr){" + std::to_string(i + 1) + "-" + std::to_string(i + shown.GroupSize(i)) + "}";
  }
  return LatexLine(groups) + rules + "\n";
}

std::string LatexHeading(const TableColumn& column) {
  if (column.unit.empty()) return LatexText(column.heading);
  return LatexText(column.heading) + " (" + (column.unit == "us" ? "$\\mu$s" : LatexText(column.unit)) + ")";
}

}  // namespace

std::string RenderTableLatex(const ShownTable& shown) {
  const Table& table = shown.table;
  std::string alignments;
  std::vector<std::string> headings;
  for (const TableColumn& column : table.columns) {
    alignments += column.alignment == Alignment::kRight ? 'r' : 'l';
    headings.push_back(LatexHeading(column));
  }
  std::string text = "\\begin{table*}\n\\centering\n";
  std::string caption;
  for (const std::string& paragraph : table.title) caption += (caption.empty() ? "" : " ") + LatexText(paragraph);
  if (!caption.empty()) text += "\\caption{" + caption + "}\n";
  text += "\\begin{tabular}{" + alignments + "}\n\\toprule\n" + (shown.has_groups() ? LatexGroups(shown) : "") +
          LatexLine(headings) + "\\midrule\n";
  std::string group;
  for (const TableRow& row : table.rows) {
    if (row.group != group) {
      text += LatexLine({Spanning(table.columns.size(), "l", "\\textbf{" + LatexText(row.group) + "}")});
      group = row.group;
    }
    std::vector<std::string> cells;
    for (const TableCell& cell : row.cells) cells.push_back(cell.shown == "-" ? "--" : LatexText(cell.shown));
    text += LatexLine(cells);
  }
  text += "\\bottomrule\n\\end{tabular}\n";
  for (std::size_t i = 0; i < table.notes.size(); ++i) {
    text += std::string("\n\\smallskip\n") + (i == 0 ? "Note: " : "") + LatexText(table.notes[i].text) + "\n";
  }
  text += "\\end{table*}\n";
  return LatexNeeds(text) + text;
}

namespace {

// Returns a field of RFC 4180, quoted only if needed.
std::string CsvField(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + "\"";
}

std::string CsvCell(const nlohmann::json& value) {
  if (value.is_null()) return {};
  if (const std::string infinity = InfinityText(value); !infinity.empty()) return infinity;
  return CsvField(value.is_string() ? value.get<std::string>() : Dump(value));
}

}  // namespace

std::string InfinityText(const nlohmann::json& value) {
  if (!value.is_number_float() || !std::isinf(value.get<double>())) return {};
  return value.get<double>() > 0 ? "inf" : "-inf";
}

std::string CsvHeader(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : ",") + CsvField(names[i]);
  return text + "\n";
}

std::string CsvRow(const std::vector<nlohmann::json>& values) {
  std::string text;
  for (std::size_t i = 0; i < values.size(); ++i) text += (i == 0 ? "" : ",") + CsvCell(values[i]);
  return text + "\n";
}

std::string RenderTableCsv(const Table& table) {
  std::vector<std::string> names;
  for (const TableColumn& column : table.columns) names.push_back(column.name);
  std::string text = CsvHeader(DistinctNames(names));
  for (const TableRow& row : table.rows) {
    std::vector<nlohmann::json> values;
    for (const TableCell& cell : row.cells) values.push_back(cell.value);
    text += CsvRow(values);
  }
  return text;
}

nlohmann::ordered_json JsonRow(const std::vector<std::string>& names, const std::vector<nlohmann::json>& values) {
  auto object = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string infinity = InfinityText(values[i]);
    object[names[i]] = infinity.empty() ? values[i] : nlohmann::json(infinity);
  }
  return object;
}

std::string IndentedJsonRow(const std::vector<std::string>& names, const std::vector<nlohmann::json>& values) {
  std::string text = "  ";
  for (const char c : JsonText(JsonRow(names, values))) {
    text += c;
    if (c == '\n') text += "  ";
  }
  return text;
}

nlohmann::ordered_json RenderTableJson(const Table& table) {
  std::vector<std::string> names;
  for (const TableColumn& column : table.columns) names.push_back(column.name);
  names = DistinctNames(names);
  auto array = nlohmann::ordered_json::array();
  for (const TableRow& row : table.rows) {
    std::vector<nlohmann::json> values;
    for (const TableCell& cell : row.cells) values.push_back(cell.value);
    array.push_back(JsonRow(names, values));
  }
  return array;
}

}  // namespace legopt::client
