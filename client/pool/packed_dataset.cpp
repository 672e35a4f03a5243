#include "client/pool/packed_dataset.h"

#include <system_error>

#include "app/data_folder.h"
#include "app/folder_cache.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/files/temporary_folder.h"
#include "legopt/files/written_file.h"

namespace legopt::client {

namespace fs = std::filesystem;

PackedDataset PackInto(const fs::path& folder, const fs::path& out) {
  const std::string bytes = PackDataset(folder, GuardedReader());
  PackedDataset packed{HashOfDataset(folder, GuardedReader()), {}};
  packed.archive = out / app::ArchiveName(packed.hash);
  std::error_code error;
  fs::create_directories(out, error);
  files::ReplaceFile(packed.archive, bytes);
  return packed;
}

OfferedFolder::OfferedFolder(const fs::path& dataset) : path_(files::CreateTemporaryFolder("legopt-datasets-")) {
  try {
    PackInto(dataset, path_);
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
    throw;
  }
}

OfferedFolder::~OfferedFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace legopt::client
