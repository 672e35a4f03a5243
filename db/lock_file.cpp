#include "db/lock_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <string>
#include <string_view>

#include "db/store_error.h"
#include "legopt/files/file_error.h"
#include "legopt/files/lock_file.h"
#include "legopt/types/classic_stream.h"

namespace legopt::db {
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

}  // namespace legopt::db
