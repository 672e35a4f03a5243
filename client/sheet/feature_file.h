#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace legopt::client {

/// A features.csv of a generated dataset: one row per problem or stance.
struct FeatureFile {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  ///< each has columns.size() cells

  /// Returns the index of a column; nothing if it does not exist.
  std::optional<std::size_t> Find(const std::string& column) const;
  /// Returns the values of a column in the rows whose column `key` is `value`; of all rows if `key` is empty. Empty if
  /// a cell is not a number.
  std::vector<double> Numbers(std::size_t column, const std::string& key, const std::string& value) const;
  /// Returns the number of rows with these cells.
  int Count(const std::vector<std::pair<std::string, std::string>>& cells) const;
  /// Returns the different cells of a column, in the order of their first rows.
  std::vector<std::string> Words(const std::string& column) const;
};

/// Reads a file with a row of names and rows of cells without quotes. Throws InputError with file and line.
FeatureFile ReadFeatures(const std::filesystem::path& path);

}  // namespace legopt::client
