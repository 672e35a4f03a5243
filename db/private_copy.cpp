#include "db/private_copy.h"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <system_error>

#include "db/store_error.h"
#include "legopt/files/file_error.h"

namespace legopt::db {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 2> kCopied = {"", "-wal"};

struct FileStamp {
  std::uintmax_t bytes = 0;
  fs::file_time_type written{};
  bool operator==(const FileStamp&) const = default;
};

std::array<FileStamp, kCopied.size()> StampsOf(const fs::path& file) {
  std::array<FileStamp, kCopied.size()> stamps;
  std::error_code ignored;
  for (std::size_t i = 0; i < kCopied.size(); ++i) {
    const fs::path name = file.string() + kCopied[i];
    stamps[i] = {fs::file_size(name, ignored), fs::last_write_time(name, ignored)};
  }
  return stamps;
}

// A copy that hits the file size limit after a partial write fails with "Input/output error".
std::string CauseOf(const std::error_code& error) {
  if (error != std::errc::io_error) return files::Explain(error.value());
  return error.message() + "; " + files::WriteAdvice("check the disk: its space and quota, its kernel messages");
}

[[noreturn]] void ThrowUnreadable(const fs::path& file, const std::error_code& error) {
  throw StoreError(StoreErrorCode::kUnwritable, file.string() + ": cannot be read: " + files::Explain(error.value()));
}

[[noreturn]] void ThrowUncopied(const fs::path& file, const fs::path& folder, const std::error_code& error) {
  const bool full = error == std::errc::no_space_on_device || error == std::errc::file_too_large;
  throw StoreError(full ? StoreErrorCode::kFull : StoreErrorCode::kUnwritable,
                   file.string() +
                       ": its log can only be read in a copy, because its folder cannot be written or its owner "
                       "is another user, and the copy in " +
                       folder.string() + " failed: " + CauseOf(error) + ", or set TMPDIR to a folder with room");
}

fs::path CopyIn(const fs::path& folder) { return folder / "copy.sqlite"; }

constexpr fs::copy_options kOverwrite = fs::copy_options::overwrite_existing;

// Returns false if another process wrote to the source during the copy.
bool CopyOnce(const fs::path& file, const fs::path& folder) {
  std::error_code error;
  const fs::path source = fs::canonical(file, error);
  const auto before = StampsOf(source);
  for (const char* suffix : kCopied) {
    const std::string target = CopyIn(folder).string() + suffix;
    const std::string part = source.string() + suffix;
    if (::access(part.c_str(), R_OK) != 0) ThrowUnreadable(part, {errno, std::generic_category()});
    fs::copy_file(part, target, kOverwrite, error);  // creates: in a private folder of this process
    if (error) ThrowUncopied(file, folder, error);
  }
  return StampsOf(source) == before;
}

}  // namespace

bool WouldLeaveSideFiles(const fs::path& file) {
  struct stat status {};
  std::error_code error;
  if (::geteuid() == 0 || ::stat(file.c_str(), &status) != 0 || status.st_uid == ::geteuid()) return false;
  return !fs::exists(fs::canonical(file, error).string() + "-shm", error);
}

PrivateCopy::PrivateCopy(const fs::path& file) : folder_(file) {
  constexpr int kTries = 3;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    if (CopyOnce(file, folder_.path())) return;
  }
  throw StoreError(StoreErrorCode::kBusy, file.string() +
                                              ": a server is writing to it, and it can only be read in a "
                                              "copy; ask the server instead, without --db");
}

fs::path PrivateCopy::path() const { return CopyIn(folder_.path()); }

PrivateCopy::Folder::Folder(const fs::path& file) {
  std::error_code error;
  std::string name = (fs::temp_directory_path(error) / "legopt-read-XXXXXX").string();
  if (error) ThrowUncopied(file, "TMPDIR", error);
  if (::mkdtemp(name.data()) == nullptr) ThrowUncopied(file, name, {errno, std::generic_category()});
  path_ = name;
}

PrivateCopy::Folder::~Folder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace legopt::db
