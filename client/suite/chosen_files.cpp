#include "client/suite/chosen_files.h"

#include <algorithm>
#include <vector>

#include "app/data_folder.h"
#include "client/client_error.h"
#include "client/suite/input_files.h"
#include "legopt/files/written_file.h"
#include "legopt/types/nearest_name.h"

namespace legopt::client {
namespace {

constexpr char kSuiteFolder[] = "suites";
constexpr char kSuiteExtension[] = ".yaml";

bool IsFolder(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error);
}

bool IsFile(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

std::vector<std::string> EmbeddedSuites(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == kSuiteExtension) names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

std::filesystem::path FindSuite(const std::string& name) {
  if (name == "-") return InputFile(name);
  if (IsFile(name)) return name;
  if (IsFolder(name)) {
    throw ClientError(ExitCode::kUsage, "'" + name + "' is a folder, not an experiment file; name a .yaml file in it");
  }
  if (files::IsStream(name)) return name;  // a pipe, <(COMMAND)
  const bool bare = name.find('/') == std::string::npos;
  if (!bare) {
    throw ClientError(ExitCode::kUsage, "no experiment file '" + name + "'; check the path");
  }
  const auto folder = app::DataFolder() / kSuiteFolder;
  const auto stem = std::filesystem::path(name).extension() == kSuiteExtension ? std::filesystem::path(name).stem()
                                                                               : std::filesystem::path(name);
  auto file = folder / stem;
  file += kSuiteExtension;
  if (IsFile(file)) return file;
  throw ClientError(ExitCode::kUsage, "no experiment file '" + name + "' here, nor an embedded one of that name; " +
                                          SuggestName(stem.string(), EmbeddedSuites(folder)));
}

std::filesystem::path ChooseDatasetFolder(const std::optional<std::string>& flag, const Suite* suite) {
  if (flag) {
    const bool bare = !flag->empty() && flag->find('/') == std::string::npos && *flag != "." && *flag != "..";
    if (!bare || IsFolder(*flag)) return *flag;
    const std::filesystem::path embedded = app::DataFolder() / *flag;
    return IsFile(embedded / "dataset.yaml") ? embedded : std::filesystem::path(*flag);
  }
  if (suite != nullptr && suite->dataset) return *suite->dataset;
  return app::DefaultDatasetFolder();
}

}  // namespace legopt::client
