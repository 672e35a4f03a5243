#include "legopt/import/file_copy.h"

#include <system_error>

#include "legopt/input_error.h"

namespace legopt {

void CopyFile(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::error_code error;
  std::filesystem::create_directories(to.parent_path(), error);
  std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing, error);
  if (!error) return;
  throw InputError({from.string(), "", "", "cannot be copied: " + error.message(), "check permissions and free space"});
}

}  // namespace legopt
