#include "app/data_folder.h"

#include <cstdlib>
#include <string>
#include <system_error>

#include "app/process_start.h"
#include "legopt/types/input_error.h"

namespace legopt::app {
namespace {

constexpr char kDefaultDataset[] = "garage-easier";
constexpr char kHardDataset[] = "garage-hard";

bool IsFolder(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error);
}

}  // namespace

std::filesystem::path ProgramFolder() {
  std::filesystem::path file = ProgramFile();
  if (!file.empty()) return file.parent_path();
  throw InputError({"", "", "", "the folder of this program is unknown: /proc is not mounted",
                    "start the program by its path, or mount /proc"});
}

std::filesystem::path DataFolder() {
  if (const char* environment = std::getenv("LEGOPT_DATA"); environment != nullptr && *environment != '\0') {
    if (IsFolder(environment)) return environment;
    throw InputError({"LEGOPT_DATA", "", environment, "no such folder",
                      "set it to the folder that holds suites/ and garage-easier/, or unset it"});
  }
  // Locations of an installed program, a built program, and a built test.
  for (const char* place : {"../share/legopt/data", "legopt-data", "../legopt-data"}) {
    const auto folder = (ProgramFolder() / place).lexically_normal();
    if (IsFolder(folder)) return std::filesystem::canonical(folder);
  }
  throw InputError({"", "", "",
                    "the embedded data folder is missing (looked for ../share/legopt/data and legopt-data beside " +
                        ProgramFolder().string() + ")",
                    "set LEGOPT_DATA to it, or give --dataset"});
}

std::filesystem::path PythonFolder() {
  std::error_code ignored;
  for (const char* place : {"../share/legopt/python", "legopt-data/../python", "../legopt-data/../python"}) {
    const auto folder = std::filesystem::canonical(ProgramFolder() / place, ignored);
    if (!folder.empty() && std::filesystem::is_regular_file(folder / "legopt" / "solver.py", ignored)) return folder;
  }
  return {};
}

std::filesystem::path DefaultDatasetFolder() { return DataFolder() / kDefaultDataset; }

std::vector<std::filesystem::path> EmbeddedDatasetFolders() {
  std::vector<std::filesystem::path> folders = {DefaultDatasetFolder()};
  if (const auto hard = DataFolder() / kHardDataset; IsFolder(hard)) folders.push_back(hard);
  return folders;
}

}  // namespace legopt::app
