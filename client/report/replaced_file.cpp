#include "client/report/replaced_file.h"

#include <fstream>
#include <system_error>

#include "client/client_error.h"

namespace legopt::client {
namespace {

void WriteInto(const std::filesystem::path& where, const std::string& text, const std::filesystem::path& asked) {
  std::ofstream stream(where, std::ios::binary);
  stream << text;
  stream.flush();
  if (!stream) {
    throw ClientError(ExitCode::kUsage,
                      asked.string() + ": cannot be written; check the folder, its permissions and the free space");
  }
}

}  // namespace

void ReplaceFile(const std::filesystem::path& path, const std::string& text) {
  std::error_code error;
  const std::filesystem::file_type type = std::filesystem::status(path, error).type();
  if (type != std::filesystem::file_type::regular && type != std::filesystem::file_type::not_found) {
    WriteInto(path, text, path);
    return;
  }
  const auto target = std::filesystem::is_symlink(path, error) ? std::filesystem::weakly_canonical(path) : path;
  const std::filesystem::path temporary = target.string() + ".new";
  try {
    WriteInto(temporary, text, path);
    std::filesystem::rename(temporary, target, error);
    if (error) {
      throw ClientError(ExitCode::kUsage, path.string() + ": cannot be replaced: " + error.message());
    }
  } catch (...) {
    std::filesystem::remove(temporary, error);
    throw;
  }
}

}  // namespace legopt::client
