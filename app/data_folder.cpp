#include "app/data_folder.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>
#include <utility>

#include "app/processes.h"
#include "legopt/files/temporary_folder.h"
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

namespace fs = std::filesystem;

fs::path NamedDatasetFolder(const std::string& name) {
  const bool bare = !name.empty() && name.find('/') == std::string::npos && name != "." && name != "..";
  std::error_code ignored;
  if (!bare || fs::is_directory(name, ignored)) return name;
  const fs::path embedded = DataFolder() / name;
  return fs::is_regular_file(embedded / "dataset.yaml", ignored) ? embedded : fs::path(name);
}

bool IsDatasetHash(const std::string& text) {
  constexpr std::size_t kDigits = 64;
  return text.size() == kDigits && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

fs::path DatasetCacheFolder() {
  const auto below = [](const char* variable, const char* folder) -> fs::path {
    const char* value = std::getenv(variable);
    return value != nullptr && *value == '/' ? fs::path(value) / folder : fs::path();
  };
  if (fs::path folder = below("XDG_CACHE_HOME", "legopt/datasets"); !folder.empty()) return folder;
  std::error_code error;
  if (fs::path folder = below("HOME", ".cache/legopt/datasets"); !folder.empty()) {
    fs::create_directories(folder, error);
    if (!error && access(folder.c_str(), W_OK) == 0) return folder;
  }
  return files::FolderForTemporaryFiles() / ("legopt-" + std::to_string(getuid())) / "datasets";
}

std::string ArchiveName(std::string_view hash) { return std::string(hash) + ".legopt-dataset"; }

OfferedDatasets::OfferedDatasets(std::optional<fs::path> folder) : folder_(std::move(folder)) {
  if (folder_ && !fs::is_directory(*folder_)) {
    throw InputError(
        {"--datasets", "", folder_->string(), "is no folder", "'legopt dataset pack' writes what belongs into it"});
  }
}

const std::string* OfferedDatasets::Find(const std::string& hash, std::size_t most_bytes) {
  if (!folder_) return nullptr;
  if (hash == hash_) return &archive_;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(*folder_, ignored)) {
    if (entry.path().filename() != ArchiveName(hash) || entry.file_size(ignored) > most_bytes) continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    archive_.assign(std::istreambuf_iterator<char>(stream), {});
    hash_ = stream ? hash : "";
    return stream ? &archive_ : nullptr;
  }
  return nullptr;
}

}  // namespace legopt::app
