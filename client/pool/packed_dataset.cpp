#include "client/pool/packed_dataset.h"

#include <system_error>

#include "files/written_file.h"
#include "legopt/dataset/dataset_archive.h"
#include "programs/isolated_call.h"
#include "programs/offered_datasets.h"

namespace legopt::client {

namespace fs = std::filesystem;

PackedDataset PackInto(const fs::path& folder, const fs::path& out) {
  const std::string bytes = PackDataset(folder, CallIsolated);
  PackedDataset packed{HashOfDataset(folder, CallIsolated), {}};
  packed.archive = out / programs::ArchiveName(packed.hash);
  std::error_code error;
  fs::create_directories(out, error);
  files::ReplaceFile(packed.archive, bytes);
  return packed;
}

}  // namespace legopt::client
