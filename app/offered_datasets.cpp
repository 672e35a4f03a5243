#include "app/offered_datasets.h"

#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "legopt/types/input_error.h"

namespace legopt::app {

namespace fs = std::filesystem;

std::string ArchiveName(std::string_view hash) { return std::string(hash) + ".legopt-dataset"; }

OfferedDatasets::OfferedDatasets(std::optional<fs::path> folder) : folder_(std::move(folder)) {
  if (folder_ && !fs::is_directory(*folder_)) {
    throw InputError(
        {"--datasets", "", folder_->string(), "is no folder", "'legopt dataset pack' writes what belongs into it"});
  }
}

const std::string* OfferedDatasets::Find(const std::string& hash, std::size_t most_bytes) {
  if (!folder_) return nullptr;
  if (hash == hash_) return &archive_;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(*folder_, ignored)) {
    if (entry.path().filename() != ArchiveName(hash) || entry.file_size(ignored) > most_bytes) continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    archive_.assign(std::istreambuf_iterator<char>(stream), {});
    hash_ = stream ? hash : "";
    return stream ? &archive_ : nullptr;
  }
  return nullptr;
}

}  // namespace legopt::app
