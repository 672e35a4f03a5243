#include "legopt/import/internal/model_uri.h"

#include <string>

namespace legopt {

namespace fs = std::filesystem;

fs::path FindByUri(const fs::path& folder, const std::string& uri) {
  std::string place = uri;
  for (const std::string scheme : {"model://", "file://", "package://"}) {
    if (place.starts_with(scheme)) place = place.substr(scheme.size());
  }
  constexpr int kLevels = 4;
  fs::path base = folder;
  for (int level = 0; level < kLevels; ++level) {
    for (const fs::path& candidate : {base / place, base / "models" / place}) {
      if (fs::exists(candidate)) return candidate;
    }
    base = base.parent_path();
  }
  return {};
}

}  // namespace legopt
