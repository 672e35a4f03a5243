#include "legopt/dataset/internal/text_file.h"

#include <fstream>
#include <iterator>
#include <system_error>

#include "legopt/files/written_file.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
constexpr const char* kIdentityName = "generation.txt";

[[noreturn]] void Refuse(const fs::path& path, const std::string& message, const std::string& fix) {
  throw InputError({path.string(), "", "", message, fix});
}

}  // namespace

void WriteTextFile(const fs::path& path, const std::string& text) { WriteOutputFile(path, text); }

StagedFolder::StagedFolder(const fs::path& folder, const std::string& identity, Unfinished unfinished)
    : folder_(fs::weakly_canonical(folder)), partial_(folder_.string() + ".partial"), lock_(partial_) {
  std::error_code error;
  if (fs::exists(fs::symlink_status(folder_, error))) {
    Refuse(folder_, "exists already; nothing is overwritten", "choose another --out, or remove it");
  }
  if (!lock_.holder().empty()) {
    Refuse(folder_, lock_.holder() + " is making it", "wait for that process, or choose another --out");
  }
  // An empty folder is one whose maker was killed at once.
  if (fs::is_directory(partial_, error) && !fs::is_empty(partial_, error)) {
    std::ifstream stream(partial_ / kIdentityName, std::ios::binary);
    const std::string found{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    if (found != identity) {
      Refuse(partial_, "holds an unfinished generation with other parameters",
             "give the same parameters to go on with it, or remove it");
    }
    if (unfinished == Unfinished::kKept) return;
    Discard();
  }
  Begin(identity);
}

void StagedFolder::Begin(const std::string& identity) {
  std::error_code error;
  fs::create_directories(partial_, error);
  if (error) Refuse(partial_, "cannot be made: " + error.message(), "check the permissions of the folder above it");
  try {
    WriteTextFile(partial_ / kIdentityName, identity);
  } catch (...) {
    Discard();
    throw;
  }
}

void StagedFolder::Finish() {
  std::error_code error;
  // An empty folder of that name would be replaced.
  if (fs::exists(fs::symlink_status(folder_, error))) {
    Refuse(folder_, "exists by now, and nothing is overwritten", "the files are complete in " + partial_.string());
  }
  fs::remove(partial_ / kIdentityName, error);
  fs::rename(partial_, folder_, error);
  if (error) Refuse(folder_, "cannot be made: " + error.message(), "the files are complete in " + partial_.string());
}

void StagedFolder::Discard() {
  std::error_code ignored;
  fs::remove_all(partial_, ignored);
}

}  // namespace legopt
