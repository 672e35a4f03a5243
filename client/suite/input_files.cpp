#include "client/suite/input_files.h"

#include <fstream>
#include <iterator>
#include <system_error>

#include "client/client_error.h"
#include "files/written_file.h"

namespace legopt::client {

std::filesystem::path InputFile(const std::string& name) { return name == "-" ? "/dev/stdin" : name; }

RereadableFile::RereadableFile(const std::filesystem::path& name, const std::filesystem::path& folder)
    : path_(InputFile(name.string())) {
  std::error_code error;
  if (!files::IsStream(path_) || std::filesystem::is_directory(path_, error)) return;
  std::ifstream stream(path_, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream.is_open() || stream.bad()) {
    throw ClientError(ExitCode::kUsage, path_.string() + ": cannot be read; check that something is written to it");
  }
  path_ = files::CreateTemporaryFile(folder, ".legopt-input-");
  copied_ = true;
  files::ReplaceFile(path_, bytes, {files::kReadableByOwner, files::Durability::kBuffered});
}

RereadableFile::~RereadableFile() {
  std::error_code ignored;
  if (copied_) std::filesystem::remove(path_, ignored);
}

std::vector<std::unique_ptr<RereadableFile>> MakeRereadable(std::vector<std::filesystem::path>& names) {
  std::vector<std::unique_ptr<RereadableFile>> files;
  for (std::filesystem::path& name : names) {
    files.push_back(std::make_unique<RereadableFile>(name, std::filesystem::current_path()));
    name = files.back()->path();
  }
  return files;
}

}  // namespace legopt::client
