#include "programs/data_folder.h"

#include <cstdlib>
#include <string>
#include <system_error>

#include "legopt/input_error.h"

namespace legopt::programs {
namespace {

constexpr char kDefaultDataset[] = "garage-easier";

bool IsFolder(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error);
}

}  // namespace

std::filesystem::path ProgramFolder() { return std::filesystem::read_symlink("/proc/self/exe").parent_path(); }

std::filesystem::path DataFolder() {
  if (const char* environment = std::getenv("LEGOPT_DATA"); environment != nullptr && *environment != '\0') {
    if (IsFolder(environment)) return environment;
    throw InputError({"LEGOPT_DATA", "", environment, "no such folder",
                      "set it to the folder that holds suites/ and garage-easier/, or unset it"});
  }
  const auto installed = (ProgramFolder() / ".." / "share" / "legopt" / "data").lexically_normal();
  if (IsFolder(installed)) return installed;
  if (IsFolder(LEGOPT_DATA_DIR)) return LEGOPT_DATA_DIR;
  throw InputError(
      {"", "", "",
       "the embedded data folder is missing (looked for " + installed.string() + " and " LEGOPT_DATA_DIR ")",
       "set LEGOPT_DATA to it, or give --dataset"});
}

std::filesystem::path DefaultDatasetFolder() { return DataFolder() / kDefaultDataset; }

}  // namespace legopt::programs
