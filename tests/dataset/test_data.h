#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "legopt/types/input_error.h"
#include "tests/folders.h"
#include "tests/temporary_folder.h"

namespace legopt::test {

/// Returns the folder of the LegOpt data: environment LEGOPT_TEST_DATA, else the folder configured in the build.
inline std::filesystem::path LegOptFolder() {
  const char* folder = std::getenv("LEGOPT_TEST_DATA");
  return folder != nullptr ? folder : TestDataFolder();
}

#define LEGOPT_SKIP_WITHOUT_TEST_DATA()                                                                              \
  if (!std::filesystem::exists(::legopt::test::LegOptFolder() / "problemsposture.json"))                             \
  GTEST_SKIP() << "LegOpt test data not found in " << ::legopt::test::LegOptFolder() << "; set LEGOPT_TEST_DATA to " \
               << "a folder with problemsposture.json to run this test"

inline void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream stream(path, std::ios::binary);
  stream << text;
  if (!stream.flush()) std::abort();
}

inline std::string ReadText(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// Replaces the only occurrence of `from`.
inline void ReplaceInFile(const std::filesystem::path& path, const std::string& from, const std::string& to) {
  std::string text = ReadText(path);
  const size_t position = text.find(from);
  ASSERT_NE(position, std::string::npos) << from;
  WriteText(path, text.replace(position, from.size(), to));
}

/// Returns the message of the InputError that `action` throws; empty (and a failure) if it throws none.
template <class Action>
std::string MessageOf(Action&& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  ADD_FAILURE() << "no InputError";
  return {};
}

/// Returns the rows of a CSV file: column name -> text.
inline std::vector<std::map<std::string, std::string>> ReadCsv(const std::filesystem::path& path) {
  const auto split = [](const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    return cells;
  };
  std::ifstream stream(path);
  std::string line;
  std::getline(stream, line);
  const std::vector<std::string> names = split(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(stream, line)) {
    const std::vector<std::string> cells = split(line);
    auto& row = rows.emplace_back();
    for (size_t i = 0; i < names.size() && i < cells.size(); ++i) row[names[i]] = cells[i];
  }
  return rows;
}

}  // namespace legopt::test
