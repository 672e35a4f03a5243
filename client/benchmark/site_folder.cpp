#include "client/benchmark/site_folder.h"

#include <unistd.h>

#include <fstream>
#include <system_error>

#include "client/client_error.h"
#include "client/report/output.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;

// The path without a final separator, which would make `folder.partial` a path inside the folder.
fs::path WithoutSeparator(const fs::path& folder) {
  const fs::path normal = fs::absolute(folder).lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

std::set<std::string> ListedFiles(const fs::path& folder) {
  std::set<std::string> files;
  std::ifstream stream(folder / SiteFolder::kListName);
  for (std::string line; std::getline(stream, line);) files.insert(line);
  return files;
}

// Throws if the folder has an entry that a former site did not write.
void RequireSiteOnly(const fs::path& folder) {
  const std::set<std::string> files = ListedFiles(folder);
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_directory() && !entry.is_symlink()) continue;
    const std::string name = entry.path().lexically_relative(folder).generic_string();
    if (name == SiteFolder::kListName || files.count(name) > 0) continue;
    throw ClientError(ExitCode::kUsage, folder.string() + " has '" + name +
                                            "', which no site wrote; name a new folder, or one of a former site");
  }
}

[[noreturn]] void Fail(const fs::path& folder, const std::error_code& error) {
  throw ClientError(ExitCode::kUsage, folder.string() + " cannot be written: " + error.message());
}

}  // namespace

SiteFolder::SiteFolder(const fs::path& folder) : folder_(WithoutSeparator(folder)) {
  partial_ = folder_.string() + ".partial-" + std::to_string(::getpid());
  std::error_code error;
  if (fs::exists(folder_, error)) {
    if (!fs::is_directory(folder_, error)) throw ClientError(ExitCode::kUsage, folder_.string() + " is no folder");
    RequireSiteOnly(folder_);
  }
  if (!fs::create_directory(partial_, error)) Fail(partial_, error);
  fs::create_directory(partial_ / "archives", error);
  if (error) Fail(partial_, error);
}

SiteFolder::~SiteFolder() {
  std::error_code ignored;
  fs::remove_all(partial_, ignored);
}

void SiteFolder::Write(const std::string& name, const std::string& text) {
  ReplaceFile(partial_ / name, text);
  files_.insert(name);
}

void SiteFolder::Finish() {
  std::string list;
  for (const std::string& name : files_) list += name + "\n";
  ReplaceFile(partial_ / kListName, list);
  std::error_code error;
  const bool replaces = fs::exists(folder_, error);
  const fs::path former = folder_.string() + ".former-" + std::to_string(::getpid());
  if (replaces) {
    fs::rename(folder_, former, error);
    if (error) Fail(folder_, error);
  }
  fs::rename(partial_, folder_, error);
  if (error) {
    std::error_code ignored;
    if (replaces) fs::rename(former, folder_, ignored);
    Fail(folder_, error);
  }
  if (replaces) fs::remove_all(former, error);
}

}  // namespace legopt::client
