#include "client/sheet/feature_file.h"

#include <algorithm>
#include <cmath>

#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

std::vector<std::string> CellsOf(const std::string& line) {
  std::vector<std::string> cells;
  ClassicInput stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

}  // namespace

std::optional<std::size_t> FeatureFile::Find(const std::string& column) const {
  const auto found = std::ranges::find(columns, column);
  return found == columns.end() ? std::nullopt : std::optional(static_cast<std::size_t>(found - columns.begin()));
}

std::vector<double> FeatureFile::Numbers(std::size_t column, const std::string& key, const std::string& value) const {
  const std::optional<std::size_t> of_key = Find(key);
  std::vector<double> numbers;
  for (const std::vector<std::string>& row : rows) {
    if (of_key && row[*of_key] != value) continue;
    const std::optional<double> number = ParseNumber(row[column]);
    if (!number || !std::isfinite(*number)) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

int FeatureFile::Count(const std::vector<std::pair<std::string, std::string>>& cells) const {
  return static_cast<int>(std::ranges::count_if(rows, [&](const std::vector<std::string>& row) {
    return std::ranges::all_of(cells, [&](const auto& cell) {
      const std::optional<std::size_t> column = Find(cell.first);
      return column && row[*column] == cell.second;
    });
  }));
}

std::vector<std::string> FeatureFile::Words(const std::string& column) const {
  std::vector<std::string> words;
  const std::optional<std::size_t> index = Find(column);
  if (!index) return words;
  for (const std::vector<std::string>& row : rows) {
    if (std::ranges::find(words, row[*index]) == words.end()) words.push_back(row[*index]);
  }
  return words;
}

FeatureFile ReadFeatures(const std::filesystem::path& path) {
  constexpr std::size_t kMostBytes = std::size_t{64} << 20;
  ClassicInput lines(ReadFileText(path, kMostBytes));
  FeatureFile file;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::vector<std::string> cells = CellsOf(line);
    if (number == 1) {
      file.columns = std::move(cells);
      continue;
    }
    if (cells.size() != file.columns.size()) {
      throw InputError({path.string(), "line " + std::to_string(number), std::to_string(cells.size()) + " cells",
                        "the first line has " + std::to_string(file.columns.size()) + " columns",
                        "restore the file, or remove it"});
    }
    file.rows.push_back(std::move(cells));
  }
  if (!file.columns.empty()) return file;
  throw InputError({path.string(), "line 1", "", "names of columns are missing", "restore the file, or remove it"});
}

}  // namespace legopt::client
