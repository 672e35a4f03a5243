#include <algorithm>
#include <array>

#include "client/benchmark_table.h"

namespace legopt::client {
namespace {

constexpr char kMeansNote[] = "Costs and times are averaged over successfully solved problems, per waypoint.";
constexpr std::size_t kKeyColumns = 3;   // method, multi-starts, sample size
constexpr std::size_t kCellColumns = 3;  // success, cost, time

std::string TaskTitle(const std::string& task) {
  if (task == "posture") return "Posture generation";
  return task == "motion" ? "Motion generation" : task;
}

std::string InitializationTitle(const std::string& initialization) {
  if (initialization == "good") return "good init";
  return initialization == "in_collision" ? "init in collision" : initialization;
}

std::string Caption(const BenchmarkTable& table) {
  std::string text = "Experiment " + std::to_string(table.experiment_id) + " '" + table.experiment + "'";
  if (!table.dataset.empty()) text += ", dataset " + table.dataset;
  text += ", " + table.rule + " rule, " + std::to_string(table.num_finished()) + "/" +
          std::to_string(table.num_jobs()) + " jobs finished";
  return text;
}

// The cells of one row as they are shown, after method, multi-starts and sample size.
std::vector<std::string> ShownCells(const BenchmarkTable& table, const BenchmarkRow& row, const TimeUnit& unit) {
  std::vector<std::string> cells = {row.method, std::to_string(row.multi_starts), std::to_string(row.sample_size)};
  for (const auto& column : table.columns) {
    const auto found = row.cells.find(column);
    if (found == row.cells.end()) {
      cells.insert(cells.end(), kCellColumns, "-");
      continue;
    }
    cells.push_back(FormatSuccess(found->second));
    cells.push_back(FormatCost(found->second.cost));
    cells.push_back(FormatTime(found->second.time_s, unit));
  }
  return cells;
}

std::vector<std::string> ColumnTitles(const BenchmarkTable& table, const std::string& time_title) {
  std::vector<std::string> titles = {"Method", "Multi-starts", "Sample size"};
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    titles.insert(titles.end(), {"Success", "Cost", time_title});
  }
  return titles;
}

std::string Centered(const std::string& text, std::size_t width) {
  const std::size_t length = DisplayWidth(text);
  const std::size_t left = length < width ? (width - length) / 2 : 0;
  return std::string(left, ' ') + text + std::string(width > left + length ? width - left - length : 0, ' ');
}

std::string RenderText(const BenchmarkTable& table) {
  const TimeUnit unit = ChooseTimeUnit(table);
  std::vector<std::vector<std::string>> lines = {ColumnTitles(table, "Time(" + unit.name + ")")};
  for (const auto& row : table.rows) lines.push_back(ShownCells(table, row, unit));

  std::vector<std::size_t> widths(lines.front().size(), 0);
  for (const auto& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], DisplayWidth(line[i]));
  }
  constexpr std::size_t kGap = 2;
  std::string groups(widths[0] + widths[1] + widths[2] + 2 * kGap, ' ');
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const std::string title = TaskTitle(table.columns[c].first) + ", " + InitializationTitle(table.columns[c].second);
    const std::size_t first = kKeyColumns + c * kCellColumns;
    const std::size_t width = widths[first] + widths[first + 1] + widths[first + 2] + 2 * kGap;
    // A long title widens its columns evenly.
    for (std::size_t extra = width; extra < DisplayWidth(title); ++extra) ++widths[first + extra % kCellColumns];
    groups += " | " + Centered(title, std::max(width, DisplayWidth(title)));
  }
  groups.erase(groups.find_last_not_of(' ') + 1);

  std::string body;
  for (std::size_t l = 0; l < lines.size(); ++l) {
    std::string text;
    for (std::size_t i = 0; i < lines[l].size(); ++i) {
      const std::string padding(widths[i] - DisplayWidth(lines[l][i]), ' ');
      const bool group_starts = i >= kKeyColumns && (i - kKeyColumns) % kCellColumns == 0;
      if (i > 0) text += group_starts ? " | " : "  ";
      text += i == 0 ? lines[l][i] + padding : padding + lines[l][i];
    }
    if (l == 0) {
      std::string rule = text;
      for (char& c : rule) c = c == '|' ? '+' : '-';
      text += "\n" + rule;
    }
    body += text + "\n";
  }
  return Caption(table) + "\n\n" + groups + "\n" + body + "\n" + kMeansNote + "\n";
}

std::string EscapeMarkdown(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, 1, '\\');
  return text;
}

std::string RenderMarkdown(const BenchmarkTable& table) {
  const TimeUnit unit = ChooseTimeUnit(table);
  std::vector<std::string> titles = {"Method", "Multi-starts", "Sample size"};
  for (const auto& [task, initialization] : table.columns) {
    const std::string group = TaskTitle(task) + ", " + InitializationTitle(initialization) + ": ";
    titles.insert(titles.end(), {group + "success", "cost", "time (" + unit.name + ")"});
  }
  const auto line = [](const std::vector<std::string>& cells) {
    std::string text = "|";
    for (const auto& cell : cells) text += " " + EscapeMarkdown(cell) + " |";
    return text + "\n";
  };
  std::string text = "**" + EscapeMarkdown(Caption(table)) + "**\n\n" + line(titles) + "|";
  for (std::size_t i = 0; i < titles.size(); ++i) text += i == 0 ? " --- |" : " ---: |";
  text += "\n";
  for (const auto& row : table.rows) text += line(ShownCells(table, row, unit));
  return text + "\n" + kMeansNote + "\n";
}

std::string EscapeLatex(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '\\':
        escaped += "\\textbackslash{}";
        break;
      case '~':
        escaped += "\\textasciitilde{}";
        break;
      case '^':
        escaped += "\\textasciicircum{}";
        break;
      case '&':
      case '%':
      case '$':
      case '#':
      case '_':
      case '{':
      case '}':
        escaped += '\\';
        [[fallthrough]];
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string LatexLine(const std::vector<std::string>& cells) {
  std::string text;
  for (std::size_t i = 0; i < cells.size(); ++i) text += (i == 0 ? "" : " & ") + cells[i];
  return text + " \\\\\n";
}

std::string RenderLatex(const BenchmarkTable& table) {
  const TimeUnit unit = ChooseTimeUnit(table);
  std::string columns = "lrr", rules;
  std::vector<std::string> groups = {"\\multicolumn{3}{c}{}"};
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    columns += "rrr";
    groups.push_back("\\multicolumn{3}{c}{" + EscapeLatex(TaskTitle(table.columns[c].first)) + ", " +
                     EscapeLatex(InitializationTitle(table.columns[c].second)) + "}");
    const std::size_t first = kKeyColumns + c * kCellColumns + 1;
    rules += "\\cmidrule(lr){" + std::to_string(first) + "-" + std::to_string(first + kCellColumns - 1) + "}";
  }
  const std::string time_title = "Time (" + std::string(unit.name == "us" ? "$\\mu$s" : unit.name) + ")";
  std::string text = "% needs \\usepackage{booktabs}\n\\begin{table*}\n\\centering\n\\caption{" +
                     EscapeLatex(Caption(table)) + "}\n\\begin{tabular}{" + columns + "}\n\\toprule\n";
  text += LatexLine(groups) + rules + "\n" + LatexLine(ColumnTitles(table, time_title)) + "\\midrule\n";
  for (const auto& row : table.rows) {
    auto cells = ShownCells(table, row, unit);
    for (auto& cell : cells) cell = cell == "-" ? "--" : EscapeLatex(cell);
    text += LatexLine(cells);
  }
  return text + "\\bottomrule\n\\end{tabular}\n\n\\smallskip\nNote: " + kMeansNote + "\n\\end{table*}\n";
}

nlohmann::ordered_json CellJson(const BenchmarkCell& cell) {
  nlohmann::ordered_json json = {{"n", cell.n}, {"finished", cell.finished}, {"solved", cell.solved}};
  json["cost"] = cell.cost ? nlohmann::ordered_json(*cell.cost) : nlohmann::ordered_json();
  json["time_s"] = cell.time_s ? nlohmann::ordered_json(*cell.time_s) : nlohmann::ordered_json();
  return json;
}

std::string RenderJson(const BenchmarkTable& table) {
  nlohmann::ordered_json json = {{"experiment_id", table.experiment_id},
                                 {"experiment", table.experiment},
                                 {"dataset", table.dataset},
                                 {"rule", table.rule},
                                 {"jobs", table.num_jobs()},
                                 {"finished", table.num_finished()}};
  json["rows"] = nlohmann::ordered_json::array();
  for (const auto& row : table.rows) {
    nlohmann::ordered_json line = {
        {"method", row.method}, {"multi_starts", row.multi_starts}, {"sample_size", row.sample_size}};
    for (const auto& column : table.columns) {
      const auto found = row.cells.find(column);
      if (found != row.cells.end()) line[column.first][column.second] = CellJson(found->second);
    }
    json["rows"].push_back(std::move(line));
  }
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string RenderCsv(const BenchmarkTable& table) {
  constexpr std::array<const char*, 5> kFigures = {"n", "finished", "solved", "cost", "time_s"};
  Listing listing;
  listing.columns = {"method", "multi_starts", "sample_size"};
  for (const auto& [task, initialization] : table.columns) {
    for (const auto* figure : kFigures) listing.columns.push_back(task + "_" + initialization + "_" + figure);
  }
  for (const auto& row : table.rows) {
    auto& line = listing.rows.emplace_back();
    line = {row.method, row.multi_starts, row.sample_size};
    for (const auto& column : table.columns) {
      const auto found = row.cells.find(column);
      const nlohmann::ordered_json cell =
          found == row.cells.end() ? nlohmann::ordered_json::object() : CellJson(found->second);
      for (const auto* figure : kFigures)
        line.push_back(cell.contains(figure) ? nlohmann::json(cell[figure]) : nullptr);
    }
  }
  return RenderListing(listing, ListingFormat::kCsv);
}

}  // namespace

std::string RenderBenchmarkTable(const BenchmarkTable& table, TableFormat format) {
  switch (format) {
    case TableFormat::kText:
      return RenderText(table);
    case TableFormat::kMarkdown:
      return RenderMarkdown(table);
    case TableFormat::kLatex:
      return RenderLatex(table);
    case TableFormat::kCsv:
      return RenderCsv(table);
    case TableFormat::kJson:
      return RenderJson(table);
  }
  return {};
}

}  // namespace legopt::client
