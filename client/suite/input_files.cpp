#include "client/suite/input_files.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "client/client_error.h"
#include "legopt/files/written_file.h"
#include "legopt/input/file_text.h"

namespace legopt::client {

std::filesystem::path InputFile(const std::string& name) { return name == "-" ? "/dev/stdin" : name; }

RereadableFile::RereadableFile(const std::filesystem::path& name, const std::filesystem::path& folder)
    : given_(InputFile(name.string())), path_(given_) {
  std::error_code error;
  if (!files::IsStream(path_) || std::filesystem::is_directory(path_, error)) return;
  constexpr std::size_t kMostBytes = std::size_t{1} << 30;
  const std::string bytes = ReadFileText(path_, kMostBytes);
  path_ = files::CreateTemporaryFile(folder, ".legopt-input-");
  copied_ = true;
  files::ReplaceFile(path_, bytes, {files::kReadableByOwner, files::Durability::kBuffered});
}

RereadableFile::~RereadableFile() {
  std::error_code ignored;
  if (copied_) std::filesystem::remove(path_, ignored);
}

std::vector<std::unique_ptr<RereadableFile>> MakeRereadable(std::vector<std::filesystem::path>& names) {
  RequireOneStandardInput(names);
  std::vector<std::unique_ptr<RereadableFile>> files;
  for (std::filesystem::path& name : names) {
    files.push_back(std::make_unique<RereadableFile>(name, std::filesystem::current_path()));
    name = files.back()->path();
  }
  return files;
}

InputError WithGivenNames(const InputError& error, std::span<const std::unique_ptr<RereadableFile>> files) {
  std::vector<InputError::Fault> faults = error.faults();
  for (InputError::Fault& fault : faults) {
    for (const std::unique_ptr<RereadableFile>& file : files) {
      const std::string copy = file->path().string();
      if (fault.file.starts_with(copy)) fault.file.replace(0, copy.size(), file->given().string());
    }
  }
  return InputError::Of(std::move(faults));
}

void RequireOneStandardInput(std::span<const std::filesystem::path> names) {
  const auto count = std::count_if(names.begin(), names.end(),
                                   [](const auto& name) { return InputFile(name.string()) == InputFile("-"); });
  if (count < 2) return;
  throw ClientError(ExitCode::kUsage, "standard input (-) is named " + std::to_string(count) +
                                          " times and can be read once; give the other texts as files");
}

}  // namespace legopt::client
