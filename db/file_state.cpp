#include "db/file_state.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "db/connection.h"
#include "db/database_file.h"
#include "db/store_error.h"
#include "legopt/files/temporary_folder.h"
#include "legopt/files/written_file.h"

namespace legopt::db {
namespace {

using Bytes = std::span<const unsigned char>;

// Both formats are described at sqlite.org/fileformat2.html. Numbers are big-endian.
constexpr std::size_t kFileHeader = 100, kPageSizeAt = 16, kWriteVersionAt = 18, kReadVersionAt = 19;
constexpr std::string_view kFileMagic{"SQLite format 3\0", 16};
constexpr std::size_t kLogHeader = 32, kLogPageSizeAt = 8, kLogSequenceAt = 12, kLogSaltAt = 16, kLogSumAt = 24;
constexpr std::size_t kFrameHeader = 24, kFrameCommitAt = 4, kFrameSaltAt = 8, kFrameSumAt = 16, kFrameSummed = 8;
constexpr std::size_t kSaltBytes = 8, kWord = 4;
constexpr std::uint32_t kLogMagic = 0x377f0682;  // the last bit: checksums of big-endian words
constexpr std::size_t kSmallestPage = 512, kLargestPage = 65536;

std::uint32_t NumberAt(Bytes bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < kWord; ++i) word = word << 8U | bytes[at + i];
  return word;
}

std::uint32_t Reversed(std::uint32_t word) { return __builtin_bswap32(word); }

class File {
 public:
  explicit File(const std::filesystem::path& path) : fd_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {}
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  /// Returns nothing if the file cannot be read or is not a regular file.
  std::optional<struct stat> Status() const {
    struct stat status {};
    if (fd_ < 0 || ::fstat(fd_, &status) != 0 || !S_ISREG(status.st_mode)) return std::nullopt;
    return status;
  }

  /// Returns false if the file ends before.
  bool Read(std::size_t at, std::span<unsigned char> bytes) const {
    const ssize_t count = ::pread(fd_, bytes.data(), bytes.size(), static_cast<off_t>(at));
    return count == std::ssize(bytes);
  }

 private:
  int fd_;
};

struct Checksum {
  std::uint32_t first = 0, second = 0;
  bool operator==(const Checksum&) const = default;

  void Add(Bytes bytes, bool big_endian) {
    for (std::size_t at = 0; at + 2 * kWord <= bytes.size(); at += 2 * kWord) {
      const std::uint32_t one = NumberAt(bytes, at), two = NumberAt(bytes, at + kWord);
      first += (big_endian ? one : Reversed(one)) + second;
      second += (big_endian ? two : Reversed(two)) + first;
    }
  }
};

Checksum StoredAt(Bytes bytes, std::size_t at) { return {NumberAt(bytes, at), NumberAt(bytes, at + kWord)}; }

bool IsPageSize(std::size_t size) { return size >= kSmallestPage && size <= kLargestPage && (size & (size - 1)) == 0; }

/// A log, read frame by frame.
class LogReader {
 public:
  LogReader(const File& log, std::size_t size) : log_(log), size_(size) {}

  /// Returns a description of the damage; empty if there is none, or if a loss of power explains it.
  std::string Fault() {
    if (size_ <= kLogHeader + kFrameHeader) return {};
    if (!log_.Read(0, header_)) return {};
    if (!HeaderIsRight()) return IsTornRestart() ? std::string() : "its header is damaged";
    std::optional<std::size_t> wrong;  // the first frame
    bool commit_behind = false;        // a complete commit follows the wrong frame
    Checksum before = StoredAt(header_, kLogSumAt);
    for (std::size_t frame = 0; Read(frame); ++frame) {
      const bool of_this_log = std::memcmp(frame_.data() + kFrameSaltAt, header_.data() + kLogSaltAt, kSaltBytes) == 0;
      const bool right = of_this_log && SumAfter(before) == StoredAt(frame_, kFrameSumAt);
      before = StoredAt(frame_, kFrameSumAt);  // also of a wrong frame: the next checksum continues from the stored one
      if (!right && !wrong) wrong = frame;
      if (!right || !wrong) continue;
      if (commit_behind) return "its frame " + std::to_string(*wrong + 1) + " is damaged, and commits follow";
      commit_behind = NumberAt(frame_, kFrameCommitAt) != 0;
    }
    return {};
  }

 private:
  bool HeaderIsRight() {
    const std::uint32_t magic = NumberAt(header_, 0);
    page_size_ = NumberAt(header_, kLogPageSizeAt);
    if ((magic & ~1U) != kLogMagic || !IsPageSize(page_size_)) return false;
    big_endian_ = (magic & 1U) != 0;
    frame_.resize(kFrameHeader + page_size_);
    Checksum sum;
    sum.Add(Bytes(header_).first(kLogSumAt), big_endian_);
    return sum == StoredAt(header_, kLogSumAt);
  }

  // Returns whether the process died while SQLite wrote a new header over that of a log whose frames are all in the
  // database. The new header has the next sequence number; the frames still belong to the old one, which had their
  // salts.
  bool IsTornRestart() {
    if (!IsPageSize(page_size_) || frame_.empty() || !Read(0)) return false;
    auto old = header_;
    const std::uint32_t sequence = NumberAt(header_, kLogSequenceAt) - 1;
    for (std::size_t i = 0; i < kWord; ++i) {
      old[kLogSequenceAt + i] = static_cast<unsigned char>(sequence >> (8U * (kWord - 1 - i)));
    }
    std::copy_n(frame_.begin() + kFrameSaltAt, kSaltBytes, old.begin() + kLogSaltAt);
    Checksum sum;
    sum.Add(Bytes(old).first(kLogSumAt), big_endian_);
    return SumAfter(sum) == StoredAt(frame_, kFrameSumAt);
  }

  bool Read(std::size_t frame) {
    const std::size_t at = kLogHeader + frame * frame_.size();
    return at + frame_.size() <= size_ && log_.Read(at, frame_);
  }

  Checksum SumAfter(Checksum before) const {
    const Bytes frame(frame_);
    before.Add(frame.first(kFrameSummed), big_endian_);
    before.Add(frame.subspan(kFrameHeader), big_endian_);
    return before;
  }

  const File& log_;
  std::size_t size_, page_size_ = 0;
  bool big_endian_ = false;
  std::array<unsigned char, kLogHeader> header_{};
  std::vector<unsigned char> frame_;
};

struct LogState {
  std::string fault;
  std::optional<struct stat> status;

  /// Returns whether the log did not change between two readings.
  bool Repeats(const LogState& other) const {
    return fault == other.fault && status && other.status && status->st_ino == other.status->st_ino &&
           status->st_size == other.status->st_size && status->st_mtim.tv_sec == other.status->st_mtim.tv_sec &&
           status->st_mtim.tv_nsec == other.status->st_mtim.tv_nsec;
  }
};

LogState ReadLogState(const std::filesystem::path& log_path) {
  const File log(log_path);
  LogState state{{}, log.Status()};
  if (state.status) state.fault = LogReader(log, static_cast<std::size_t>(state.status->st_size)).Fault();
  return state;
}

// A server may write while the log is read: a fault counts once it is found twice in the same state of the log.
std::string FaultOfLog(const std::filesystem::path& log_path) {
  constexpr std::chrono::milliseconds kBetween{50};
  LogState state = ReadLogState(log_path);
  while (!state.fault.empty()) {
    std::this_thread::sleep_for(kBetween);
    LogState next = ReadLogState(log_path);
    if (next.Repeats(state)) return state.fault;
    state = std::move(next);
  }
  return {};
}

bool HoldsBytes(const std::filesystem::path& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return !error && size > 0;
}

bool IsKnownVersion(unsigned version) { return version == 1 || version == 2; }

std::string FaultOfFile(const std::filesystem::path& path, bool can_recover) {
  const File file(path);
  const auto status = file.Status();
  std::array<unsigned char, kFileHeader> header{};
  if (!status || !file.Read(0, header) || std::memcmp(header.data(), kFileMagic.data(), kFileMagic.size()) != 0) {
    return {};
  }
  for (const std::size_t at : {kWriteVersionAt, kReadVersionAt}) {
    if (!IsKnownVersion(header[at])) return "its header names the unknown format version " + std::to_string(header[at]);
  }
  std::size_t page_size = static_cast<std::size_t>(header[kPageSizeAt]) << 8U | header[kPageSizeAt + 1];
  if (page_size == 1) page_size = kLargestPage;
  // An interrupted checkpoint leaves the log, and an interrupted rollback the journal, which contain the page.
  if (!can_recover && IsPageSize(page_size) && static_cast<std::size_t>(status->st_size) % page_size != 0) {
    return "its last page is cut off";
  }
  return {};
}

}  // namespace

void RequireSoundFiles(const std::filesystem::path& file) {
  const std::string name = file.string(), log = name + "-wal";
  const bool can_recover = HoldsBytes(log) || HoldsBytes(name + "-journal");
  if (const std::string fault = FaultOfFile(file, can_recover); !fault.empty()) {
    throw StoreError(StoreErrorCode::kCorrupt, name + ": the file is damaged (" + fault +
                                                   "); restore a backup: 'legopt service restore BACKUP --db FILE'");
  }
  if (const std::string fault = FaultOfLog(log); !fault.empty()) {
    throw StoreError(StoreErrorCode::kCorrupt,
                     name + ": the log " + log + " is damaged (" + fault +
                         "): results in it are lost; restore a backup: 'legopt service restore "
                         "BACKUP --db FILE'; to use the file as it was before the "
                         "log, move its -wal, -shm and .lock away");
  }
}

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

constexpr char kOnlyInACopy[] =
    ": its log can only be read in a copy, because its folder cannot be written or its owner is another user; ";

[[noreturn]] void ThrowUncopied(const fs::path& file, const fs::path& folder, const std::error_code& error) {
  const bool full = error == std::errc::no_space_on_device || error == std::errc::file_too_large;
  throw StoreError(full ? StoreErrorCode::kFull : StoreErrorCode::kUnwritable,
                   file.string() + kOnlyInACopy + folder.string() + ": the copy failed: " + CauseOf(error) +
                       ", or set TMPDIR to a folder with room");
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
  try {
    path_ = files::CreateTemporaryFolder("legopt-read-");
  } catch (const files::FileError& error) {
    throw StoreError(StoreErrorCode::kUnwritable, file.string() + kOnlyInACopy + error.what());
  }
}

PrivateCopy::Folder::~Folder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

namespace {

constexpr char kNewSession[] = "UPDATE file_state SET session = lower(hex(randomblob(16)))";

bool HasLog(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file.string() + "-wal", error);
  return !error && size > 0;
}

[[noreturn]] void ThrowForeignLog(const std::filesystem::path& file) {
  const std::string name = file.string();
  throw StoreError(
      StoreErrorCode::kCorrupt,
      name + ": the log " + name +
          "-wal beside it was written for another file (was a backup copied over a database?); to restore "
          "a backup: 'legopt service restore BACKUP --db FILE'; to read this file as it is, move its -wal, -shm "
          "and .lock away");
}

// Returns the session stored in the file itself, ignoring its log; "" if it has none. Returns nullopt if the file is
// damaged; the caller reads more of the file and reports the damage.
std::optional<std::string> SessionInFile(const std::filesystem::path& file) {
  try {
    Connection connection(file, Connection::Mode::kImmutable);
    return SessionOf(connection).value_or("");
  } catch (const StoreError&) {
    return std::nullopt;
  }
}

// Returns the session of file and log together. A foreign log makes the database malformed in arbitrary places.
std::optional<std::string> SessionWithLog(const std::filesystem::path& file) {
  try {
    std::optional<PrivateCopy> copy;
    if (WouldLeaveSideFiles(file)) copy.emplace(file);
    Connection connection(copy ? copy->path() : file, Connection::Mode::kReadOnly);
    return SessionOf(connection).value_or("");
  } catch (const StoreError& error) {
    if (error.code() == StoreErrorCode::kCorrupt || error.code() == StoreErrorCode::kNotLegopt) ThrowForeignLog(file);
    return std::nullopt;
  }
}

// Returns false if a reader still needs part of the log.
bool CheckpointAll(Connection& connection) {
  Statement checkpoint(connection, "PRAGMA wal_checkpoint(PASSIVE)", false);
  return checkpoint.Step() && checkpoint.column_int(1) == checkpoint.column_int(2);
}

}  // namespace

std::optional<std::string> SessionOf(Connection& connection) {
  if (connection.QueryInt("SELECT count(*) FROM sqlite_schema WHERE name = 'file_state' AND type = 'table'") == 0) {
    return std::nullopt;
  }
  return connection.QueryText("SELECT session FROM file_state");
}

void RequireOwnLog(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::path canonical = std::filesystem::canonical(path, error);
  const std::filesystem::path& file = error ? path : canonical;  // side files are next to the real file
  RequireSoundFiles(file);
  std::vector<std::string> named = LockFile::SessionsFor(file);
  while (HasLog(file)) {
    const std::optional<std::string> in_file = SessionInFile(file);
    if (!in_file) return;
    const std::vector<std::string> named_before = std::exchange(named, LockFile::SessionsFor(file));
    if (named != named_before) continue;  // a server is just starting
    if (std::find(named.begin(), named.end(), *in_file) != named.end()) return;
    if (!named.empty()) ThrowForeignLog(file);
    // The log has no lock file. If the database has sessions, every commit writes the session's row, so the log
    // contains it.
    const std::optional<std::string> with_log = SessionWithLog(file);
    if (with_log && !in_file->empty() && with_log != in_file) ThrowForeignLog(file);
    return;
  }
}

void BeginSession(Connection& connection, LockFile& lock) {
  // Write the session to the lock file only after it is in the database file.
  if (!CheckpointAll(connection)) return;
  const std::string before = SessionOf(connection).value_or("");
  std::string session;
  {
    Transaction transaction(connection);
    connection.Execute(kNewSession);
    session = SessionOf(connection).value_or("");
    lock.NameSessions({before, session});
    transaction.Commit();
  }
  // Until the whole log is in the file, the file may still contain the previous session.
  if (CheckpointAll(connection)) lock.NameSessions({session});
}

void RenewSession(Connection& copy) {
  if (SessionOf(copy)) copy.Execute(kNewSession);
}

}  // namespace legopt::db
