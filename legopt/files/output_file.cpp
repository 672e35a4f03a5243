#include "legopt/files/output_file.h"

#include <cerrno>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>

#include "legopt/files/file_error.h"
#include "legopt/types/input_error.h"

namespace legopt {

void WriteOutputFile(const std::filesystem::path& path, std::string_view bytes, const files::WriteOptions& options) {
  try {
    files::ReplaceFile(path, bytes, options);
  } catch (const files::FileError& error) {
    if (error.shortage()) throw;
    throw InputError({path.string(), "", "", error.reason(), ""});
  }
}

void CopyOutputFile(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::ifstream stream(from, std::ios::binary);
  if (!stream && files::IsShortage(errno)) throw std::system_error(errno, std::generic_category(), from.string());
  const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  std::error_code error;
  if (!stream.is_open() || stream.bad() || std::filesystem::is_directory(from, error)) {
    throw InputError({from.string(), "", "", "cannot be read", "check that the file exists and its permissions"});
  }
  std::filesystem::create_directories(to.parent_path(), error);
  WriteOutputFile(to, bytes, {files::kReadableByAll, files::Durability::kBuffered});
}

}  // namespace legopt
