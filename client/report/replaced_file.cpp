#include "client/report/replaced_file.h"

#include "client/client_error.h"
#include "legopt/files/file_error.h"
#include "legopt/files/written_file.h"

namespace legopt::client {

void ReplaceFile(const std::filesystem::path& path, const std::string& text) {
  try {
    files::ReplaceFile(path, text);
  } catch (const files::FileError& error) {
    throw ClientError(error.shortage() ? ExitCode::kMachine : ExitCode::kUsage, error.what());
  }
}

}  // namespace legopt::client
