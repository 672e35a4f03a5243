#include "client/report/paper_table.h"

#include <algorithm>
#include <cctype>
#include <charconv>

#include "legopt/input/file_text.h"
#include "legopt/types/classic_stream.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

const std::vector<std::string> kColumnFigures = {"n", "solved", "cost", "time_s"};

std::vector<std::string> Fields(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

std::vector<std::string> Titles() {
  std::vector<std::string> titles = {"method", "multi_starts", "sample_size"};
  for (const auto& column : kPaperColumns) {
    for (const auto& figure : kColumnFigures) titles.push_back(ColumnName(column) + "_" + figure);
  }
  return titles;
}

// A split line of the file; numbers are parsed on demand so that an error names the column.
class Line {
 public:
  Line(std::string place, const std::string& text) : place_(std::move(place)), fields_(Fields(text)) {
    if (fields_.size() != Titles().size()) {
      throw InputError({place_, "", text, "has not one field per column", "see the line of titles"});
    }
  }

  const std::string& Text(std::size_t column) const { return fields_[column]; }

  std::optional<double> Number(std::size_t column) const {
    const std::string& text = fields_[column];
    if (text.empty()) return std::nullopt;
    double value = 0;
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
    if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size()) {
      throw InputError({place_, Titles()[column], text, "is not a number", "leave it empty for a dash"});
    }
    return value;
  }

  std::int64_t Count(std::size_t column) const { return static_cast<std::int64_t>(Number(column).value_or(0)); }

 private:
  std::string place_;
  std::vector<std::string> fields_;
};

BenchmarkRow ReadRow(const Line& line) {
  BenchmarkRow row;
  std::size_t at = 0;
  row.method = line.Text(at++);
  row.multi_starts = line.Count(at++);
  row.sample_size = line.Count(at++);
  for (const auto& column : kPaperColumns) {
    BenchmarkCell& cell = row.cells[column];
    cell.n = cell.finished = line.Count(at++);
    cell.solved = line.Count(at++);
    cell.cost = line.Number(at++);
    cell.time_s = line.Number(at++);
  }
  return row;
}

bool SameName(const std::string& a, const std::string& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

}  // namespace

std::vector<BenchmarkRow> ReadPaperTable(const std::filesystem::path& file) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20;
  ClassicInput stream(ReadFileText(file, kMostBytes));
  std::vector<BenchmarkRow> rows;
  bool titles_seen = false;
  int number = 0;
  for (std::string text; std::getline(stream, text);) {
    ++number;
    if (text.empty() || text[0] == '#') continue;
    const std::string place = file.string() + ":" + std::to_string(number);
    if (titles_seen) {
      rows.push_back(ReadRow(Line(place, text)));
    } else if (Fields(text) != Titles()) {
      throw InputError({place, "", text, "does not name the columns of the paper's table", "restore the file"});
    }
    titles_seen = true;
  }
  if (rows.empty())
    throw InputError({file.string(), "", "", "cannot be read as the paper's table", "restore the file"});
  return rows;
}

void AddPaperFigures(const std::vector<BenchmarkRow>& paper, BenchmarkTable* table) {
  table->compared = true;
  for (auto& row : table->rows) {
    const auto found = std::find_if(paper.begin(), paper.end(), [&row](const BenchmarkRow& candidate) {
      return SameName(candidate.method, row.method) && candidate.multi_starts == row.multi_starts &&
             candidate.sample_size == row.sample_size;
    });
    if (found != paper.end()) row.paper = found->cells;
  }
}

}  // namespace legopt::client
