#include "client/commands/claimed_name.h"

#include <system_error>

#include "files/written_file.h"

namespace legopt::client {

ClaimedName::ClaimedName(const std::string& stem, const std::string& extension) : path_(stem + extension) {
  for (int i = 2; !files::ClaimName(path_); ++i) path_ = stem + "-" + std::to_string(i) + extension;
}

ClaimedName::~ClaimedName() {
  std::error_code error;
  if (std::filesystem::file_size(path_, error) == 0 && !error) std::filesystem::remove(path_, error);
}

}  // namespace legopt::client
