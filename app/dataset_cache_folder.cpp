#include "app/dataset_cache_folder.h"

#include <unistd.h>

#include <cstdlib>
#include <system_error>

namespace legopt::app {

namespace fs = std::filesystem;

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
  return fs::temp_directory_path() / ("legopt-" + std::to_string(getuid())) / "datasets";
}

}  // namespace legopt::app
