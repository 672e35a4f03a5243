#include "db/file_check.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "db/store_error.h"

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

bool HasContent(const std::filesystem::path& path) {
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
  const bool can_recover = HasContent(log) || HasContent(name + "-journal");
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

}  // namespace legopt::db
