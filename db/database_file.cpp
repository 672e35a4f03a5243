#include "db/database_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <system_error>

#include "db/store_error.h"
#include "legopt/files/name_lock.h"
#include "legopt/files/written_file.h"
#include "legopt/types/number_text.h"

namespace legopt::db {
namespace {

struct FileSystem {
  std::int64_t type;
  std::string_view name;
};

// Magic numbers from <linux/magic.h> or, if not listed there, from the file system's sources.
constexpr std::array<FileSystem, 13> kUnsupportedFileSystems = {{
    {0x6969, "NFS"},
    {0x517b, "SMB"},
    {0xfe534d42, "SMB"},
    {0xff534d42, "SMB (CIFS)"},
    {0x0bd00bd0, "Lustre"},
    {0x47504653, "GPFS (Spectrum Scale)"},
    {0x19830326, "BeeGFS"},
    {0x00c36400, "Ceph"},
    {0x5346414f, "AFS"},
    {0xaad7aaea, "PanFS"},
    {0x7461636f, "OCFS2"},
    {0x01021997, "9P"},
    {0x65735546, "FUSE"},
}};

}  // namespace

std::optional<std::string_view> UnsupportedFileSystemName(std::int64_t type) {
  const auto found = std::find_if(kUnsupportedFileSystems.begin(), kUnsupportedFileSystems.end(),
                                  [type](const auto& row) { return row.type == type; });
  return found == kUnsupportedFileSystems.end() ? std::nullopt : std::optional(found->name);
}

std::optional<std::int64_t> FileSystemOf(const std::filesystem::path& file) {
  struct statfs system {};
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::absolute(file, error).parent_path();
  if (statfs(file.c_str(), &system) != 0 && statfs(folder.c_str(), &system) != 0) return std::nullopt;
  constexpr std::int64_t kWord = 0xffffffff;  // some kernels return a signed number
  return static_cast<std::int64_t>(system.f_type) & kWord;
}

std::optional<DiskSpace> SpaceAt(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(file, error);
  if (error) return std::nullopt;
  return DiskSpace{static_cast<std::int64_t>(space.available), static_cast<std::int64_t>(space.capacity)};
}

namespace {

constexpr std::string_view kSession = "session ";

std::vector<std::string> LinesOf(int descriptor) {
  std::array<char, 1000> text{};
  const ssize_t size = pread(descriptor, text.data(), text.size(), 0);
  ClassicInput stream(std::string(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0));
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> ReadSessions(int descriptor) {
  std::vector<std::string> sessions;
  for (const std::string& line : LinesOf(descriptor)) {
    if (line.starts_with(kSession)) sessions.push_back(line.substr(kSession.size()));
  }
  return sessions;
}

std::string ReadHolder(int descriptor) {
  const std::vector<std::string> lines = LinesOf(descriptor);
  return lines.empty() || lines.front().empty() ? "unknown process" : lines.front();
}

// Overwrites the old content before truncating, so that the file lists sessions at every moment.
bool WriteContent(int descriptor, const std::vector<std::string>& sessions) {
  std::array<char, 100> host{};
  gethostname(host.data(), host.size() - 1);
  std::string text = files::kLockFileBeginning + std::to_string(getpid()) + " on " + host.data() + "\n";
  for (const std::string& session : sessions) text += std::string(kSession) + session + "\n";
  return pwrite(descriptor, text.data(), text.size(), 0) == std::ssize(text) &&
         ftruncate(descriptor, std::ssize(text)) == 0 && fsync(descriptor) == 0;
}

bool HasContent(const std::filesystem::path& file) {
  struct stat status {};
  return stat(file.c_str(), &status) == 0 && status.st_size > 0;
}

std::filesystem::path LockPath(const std::filesystem::path& database) { return database.string() + ".lock"; }

// Returns whether the path still leads to the open file. The previous holder removes the file when it ends cleanly, and
// a lock on a removed file protects nothing.
bool IsStillThere(int descriptor, const std::filesystem::path& path) {
  struct stat by_descriptor {};
  struct stat by_name {};
  return fstat(descriptor, &by_descriptor) == 0 && stat(path.c_str(), &by_name) == 0 &&
         by_descriptor.st_ino == by_name.st_ino && by_descriptor.st_dev == by_name.st_dev;
}

int OpenLock(const std::filesystem::path& path) {
  try {
    return files::OpenLockFile(path);
  } catch (const files::FileError& error) {
    throw StoreError(error.shortage() ? StoreErrorCode::kShortage : StoreErrorCode::kUnwritable,
                     path.string() + ": the lock file " + error.reason());
  }
}

}  // namespace

LockFile::LockFile(const std::filesystem::path& database) : database_(database), path_(LockPath(database)) {
  while (true) {
    descriptor_ = OpenLock(path_);
    if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      const std::string holder = ReadHolder(descriptor_);
      close(descriptor_);
      if (error == EINTR) continue;
      if (error == EWOULDBLOCK) {
        throw StoreError(StoreErrorCode::kLocked, path_.string() + ": another legopt-server (" + holder +
                                                      ") works on this database; stop it or choose another file");
      }
      throw StoreError(StoreErrorCode::kUnwritable, path_.string() + ": cannot lock: " + std::strerror(error) +
                                                        "; the database must be on a local disk");
    }
    if (IsStillThere(descriptor_, path_)) break;
    close(descriptor_);
  }
  sessions_ = ReadSessions(descriptor_);
  // Best effort: the content informs the user, the lock does not depend on it.
  [[maybe_unused]] const bool written = WriteContent(descriptor_, sessions_);
}

LockFile::~LockFile() {
  if (sessions_.empty() || !HasContent(database_.string() + "-wal")) unlink(path_.c_str());
  close(descriptor_);
}

void LockFile::NameSessions(const std::vector<std::string>& sessions) {
  if (!WriteContent(descriptor_, sessions)) {
    throw StoreError(StoreErrorCode::kIo, path_.string() + ": cannot be written: " + std::strerror(errno) +
                                              "; check the disk: its space and quota");
  }
  sessions_ = sessions;
}

std::vector<std::string> LockFile::SessionsFor(const std::filesystem::path& database) {
  const int descriptor = open(LockPath(database).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (descriptor < 0) return {};
  std::vector<std::string> sessions = ReadSessions(descriptor);
  close(descriptor);
  return sessions;
}

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
  const int refusal = descriptor_ < 0 ? errno : 0;
  // For a read-only file, let SQLite fail: its error message is better.
  if (refusal == EACCES || refusal == EROFS) descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) {
    throw StoreError(files::IsShortage(refusal) ? StoreErrorCode::kShortage : StoreErrorCode::kUnwritable,
                     path.string() + ": cannot open the database: " + files::Explain(refusal));
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
