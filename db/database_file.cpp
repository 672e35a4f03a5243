#include "db/database_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "db/file_system.h"
#include "db/store_error.h"
#include "legopt/files/file_error.h"
#include "legopt/files/written_file.h"
#include "legopt/types/classic_stream.h"

namespace legopt::db {
namespace {

[[noreturn]] void Unwritable(const std::filesystem::path& path, const std::string& what) {
  throw StoreError(StoreErrorCode::kUnwritable, path.string() + ": " + what);
}

std::string Reason() { return std::generic_category().message(errno); }

// Called before any file is created.
void RequireSupportedFileSystem(const std::filesystem::path& path) {
  const auto type = FileSystemOf(path);
  const auto unfit = type ? UnsupportedFileSystemName(*type) : std::nullopt;
  if (!unfit) return;
  Unwritable(path, "is on " + std::string(*unfit) +
                       ", where SQLite's log and locks do not work and databases have been lost; keep it on a local "
                       "disk (/var/tmp, a scratch disk) and copy it with 'legopt service backup'");
}

// Returns the process that holds the flock, from the lines "1: FLOCK  ADVISORY  WRITE PID MAJOR:MINOR:INODE ..." of
// /proc/locks.
std::string HolderOf(ino_t inode) {
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  std::ifstream locks("/proc/locks");
  if (!locks) return std::string("an unknown process on ") + host.data();
  for (std::string line; std::getline(locks, line);) {
    ClassicInput words(line);
    std::string number, kind, advisory, mode, file;
    long pid = 0;
    if (!(words >> number >> kind >> advisory >> mode >> pid >> file) || kind != "FLOCK" || pid <= 0) continue;
    if (file.substr(file.rfind(':') + 1) != std::to_string(inode)) continue;
    return "process " + std::to_string(pid) + " on " + host.data();
  }
  return std::string("a process of another container on ") + host.data();
}

}  // namespace

DatabaseFile::DatabaseFile(const std::filesystem::path& path) {
  Open(path);
  try {
    lock_ = std::make_unique<LockFile>(path_);
    LockItself();
  } catch (...) {
    CloseAndRemoveEmpty();
    throw;
  }
}

DatabaseFile::~DatabaseFile() { CloseAndRemoveEmpty(); }

// Removes the file if this process created it and never wrote to it, e.g. without disk space or permission.
void DatabaseFile::CloseAndRemoveEmpty() {
  struct stat status {};
  const bool ours =
      created_ && fstat(descriptor_, &status) == 0 && status.st_size == 0 && IdentityOf(path_) == identity_;
  if (ours) unlink(path_.c_str());
  close(descriptor_);
}

void DatabaseFile::Open(const std::filesystem::path& path) {
  RequireSupportedFileSystem(path);
  std::error_code unknown;
  created_ = !std::filesystem::exists(path, unknown);
  descriptor_ = files::OpenOrCreate(path);
  // For a read-only file, let SQLite fail: its error message is better.
  if (descriptor_ < 0 && (errno == EACCES || errno == EROFS)) descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0 && files::IsShortage(errno)) {
    throw StoreError(StoreErrorCode::kShortage, path.string() + ": cannot open the database: " + files::Explain(errno));
  }
  if (descriptor_ < 0) {
    Unwritable(path, "cannot open the database: " + Reason() + "; check that the folder exists and can be written");
  }
  struct stat status {};
  std::error_code error;
  path_ = std::filesystem::canonical(path, error);
  if (fstat(descriptor_, &status) != 0 || error) {
    const std::string reason = error ? error.message() : Reason();
    close(descriptor_);
    Unwritable(path, "cannot be found again after it was opened: " + reason + "; check the path");
  }
  identity_ = {status.st_dev, status.st_ino};
}

void DatabaseFile::LockItself() {
  while (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EINTR) continue;
    if (errno == EWOULDBLOCK) {
      throw StoreError(StoreErrorCode::kLocked, path_.string() + ": another legopt-server (" +
                                                    HolderOf(identity_.inode) +
                                                    ") works on this file under another name; stop it or choose "
                                                    "another file");
    }
    Unwritable(path_, "cannot be locked: " + Reason() + "; the database must be on a local disk");
  }
}

std::optional<DatabaseFile::Identity> DatabaseFile::IdentityOf(const std::filesystem::path& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return std::nullopt;
  return Identity{status.st_dev, status.st_ino};
}

void DatabaseFile::RememberSideFiles() {
  for (std::size_t i = 0; i < kSideFiles.size(); ++i) side_files_[i] = IdentityOf(path_.string() + kSideFiles[i]);
}

DatabaseFile::Place DatabaseFile::Look() const {
  const auto at_path = IdentityOf(path_);
  // A temporarily inaccessible folder does not mean that the file was moved.
  if (!at_path && errno != ENOENT && errno != ENOTDIR) return Place::kThere;
  if (at_path != identity_) {
    struct stat status {};
    return fstat(descriptor_, &status) == 0 && status.st_nlink > 0 ? Place::kElsewhere : Place::kNowhere;
  }
  for (std::size_t i = 0; i < kSideFiles.size(); ++i) {
    if (side_files_[i] && IdentityOf(path_.string() + kSideFiles[i]) != side_files_[i]) return Place::kSideFile;
  }
  return Place::kThere;
}

std::string DatabaseFile::Describe(Place place) const {
  const bool replaced = IdentityOf(path_).has_value();
  if (place == Place::kNowhere) return replaced ? "the file was replaced by another one" : "the file was removed";
  if (place == Place::kSideFile) return "its side file -wal or -shm was removed or replaced";
  // The kernel updates the link target when an open file is renamed.
  std::error_code error;
  const std::string name = std::filesystem::read_symlink(DescriptorPath(), error).string();
  if (!error && IdentityOf(name) == identity_) {
    return "the file was moved to " + name + (replaced ? " and another one put in its place" : "");
  }
  return "this name of the file was removed, another hard link to it is left";
}

std::string DatabaseFile::DescriptorPath() const {
  return "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(descriptor_);
}

}  // namespace legopt::db
