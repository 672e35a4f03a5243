#include "client/pool/packed_dataset.h"

#include <fstream>
#include <system_error>

#include "client/client_error.h"
#include "legopt/dataset/dataset_archive.h"
#include "programs/isolated_call.h"
#include "programs/offered_datasets.h"

namespace legopt::client {

namespace fs = std::filesystem;

PackedDataset PackInto(const fs::path& folder, const fs::path& out) {
  const std::string bytes = PackDataset(folder, CallIsolated);
  PackedDataset packed{HashOfDataset(folder, CallIsolated), {}};
  packed.archive = out / programs::ArchiveName(packed.hash);
  const fs::path unfinished = packed.archive.string() + ".new";
  std::error_code error;
  fs::create_directories(out, error);
  std::ofstream stream(unfinished, std::ios::binary);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (stream) fs::rename(unfinished, packed.archive, error);
  if (!stream || error) {
    throw ClientError(ExitCode::kUsage, packed.archive.string() + " cannot be written" +
                                            (error ? ": " + error.message() : "") +
                                            "; choose another folder, or make room");
  }
  return packed;
}

}  // namespace legopt::client
