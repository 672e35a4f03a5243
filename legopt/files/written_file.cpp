#include "legopt/files/written_file.h"

#include <fcntl.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "legopt/types/input_error.h"

namespace legopt::files {
namespace {

// Returns the limit on file sizes as text; empty if there is none.
std::string FileSizeLimit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return {};
  return "no file may exceed " + std::to_string(limit.rlim_cur) + " bytes here; raise 'ulimit -f'";
}

}  // namespace

bool IsShortage(int error) { return error == EMFILE || error == ENFILE || error == ENOMEM; }

std::string Explain(int error) {
  const std::string text = std::generic_category().message(error);
  switch (error) {
    case EFBIG:
      return text + ": " + WriteAdvice("use another file system");
    case ENOSPC:
    case EDQUOT:
      return text + "; make room, or choose another folder";
    case EMFILE:
      return text + "; raise 'ulimit -n'";
    case ENFILE:
      return text + "; close other programs";
    case ENOENT:
      return text + "; check that the folder exists";
    case EACCES:
    case EPERM:
    case EROFS:
      return text + "; check the permissions of the file and its folder";
    case EEXIST:
      return text + "; choose another name";
    default:
      return text + "; check the path";
  }
}

std::string WriteAdvice(const std::string& usual) {
  const std::string limit = FileSizeLimit();
  return limit.empty() ? usual : limit;
}

FileError::FileError(const std::filesystem::path& path, const std::string& action, int error, const std::string& advice)
    : std::runtime_error(path.string() + ": " + action + ": " + Explain(error) + advice),
      reason_(action + ": " + Explain(error) + advice),
      error_(error) {}

namespace {

namespace fs = std::filesystem;
constexpr const char* kCannotBeWritten = "cannot be written";
constexpr int kAttempts = 100;  // number of file names to try

/// File descriptor, closed by the destructor.
class OpenFile {
 public:
  explicit OpenFile(int fd) : fd_(fd) {}
  ~OpenFile() {
    if (fd_ >= 0) ::close(fd_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

// Returns 0 or errno.
int WriteAll(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(fd, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno;
    if (count == 0) return EIO;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return 0;
}

// Returns 0 or errno. Some file systems do not support sync; that is no error.
int Sync(int fd) { return ::fsync(fd) == 0 || errno == EINVAL || errno == EROFS ? 0 : errno; }

int OpenNew(const fs::path& path, mode_t mode) {
  return ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode);
}

std::string RandomDigits() {
  std::uint64_t number = 0;
  if (::getrandom(&number, sizeof(number), 0) != sizeof(number)) number = static_cast<std::uint64_t>(::getpid());
  std::array<char, 16> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number, 16).ptr;
  return {digits.data(), end};
}

// Returns an unpredictable file name in the folder of `target`.
fs::path TemporaryBeside(const fs::path& target) {
  constexpr std::size_t kMaxOfName = 200;  // a name has at most 255 bytes
  const std::string name = target.filename().string().substr(0, kMaxOfName);
  return target.parent_path() / (name + "." + RandomDigits() + ".new");
}

// Returns the path after following symbolic links. For a dangling link it is the file that the link would create.
fs::path FollowLinks(fs::path path) {
  constexpr int kMaxLinks = 40;
  std::error_code error;
  for (int i = 0; i < kMaxLinks && fs::is_symlink(path, error); ++i) {
    path = path.parent_path() / fs::read_symlink(path, error);
  }
  return path;
}

// Syncs the folder's entry of a renamed file. Ignores failures: some file systems cannot do it, and the file itself is
// synced.
void SyncFolder(const fs::path& folder) {
  const OpenFile opened(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened.get() >= 0) ::fsync(opened.get());
}

// Returns the descriptor named by "/dev/stdout", "/dev/fd/1" or "/proc/self/fd/1"; here: 1.
std::optional<int> OwnDescriptor(const fs::path& path) {
  const std::string name = path.string();
  if (name == "/dev/stdout") return STDOUT_FILENO;
  if (name == "/dev/stderr") return STDERR_FILENO;
  for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (!name.starts_with(folder)) continue;
    int number = -1;
    const char* const end = name.data() + name.size();
    const auto parsed = std::from_chars(name.data() + folder.size(), end, number);
    if (parsed.ec == std::errc{} && parsed.ptr == end && number >= 0) return number;
  }
  return std::nullopt;
}

void WriteIntoStream(const fs::path& path, std::string_view bytes) {
  const auto own = OwnDescriptor(path);
  const OpenFile stream(own ? ::fcntl(*own, F_DUPFD_CLOEXEC, 0)
                            : ::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY));
  const int error = stream.get() < 0 ? errno : WriteAll(stream.get(), bytes);
  if (error != 0) throw FileError(path, kCannotBeWritten, error);
}

}  // namespace

NewFile::NewFile(fs::path path, const WriteOptions& options)
    : path_(std::move(path)), durability_(options.durability), fd_(OpenNew(path_, options.mode)) {
  if (fd_ >= 0) return;
  throw FileError(path_, errno == EEXIST ? "exists already and is not overwritten" : "cannot be created", errno);
}

NewFile::~NewFile() {
  if (fd_ < 0) return;
  ::close(fd_);
  ::unlink(path_.c_str());
}

void NewFile::Write(std::string_view bytes) {
  if (const int error = WriteAll(fd_, bytes); error != 0) throw FileError(path_, kCannotBeWritten, error);
}

void NewFile::Finish() {
  const int error = durability_ == Durability::kSynced ? Sync(fd_) : 0;
  if (error != 0) throw FileError(path_, kCannotBeWritten, error);
  ::close(std::exchange(fd_, -1));
}

void CreateFile(const fs::path& path, std::string_view bytes, const WriteOptions& options) {
  NewFile file(path, options);
  file.Write(bytes);
  file.Finish();
}

void ReplaceFile(const fs::path& path, std::string_view bytes, const WriteOptions& options) {
  if (IsStream(path)) return WriteIntoStream(path, bytes);
  const fs::path target = FollowLinks(path);
  const fs::path temporary = TemporaryBeside(target);
  try {
    CreateFile(temporary, bytes, options);
  } catch (const FileError& error) {
    throw FileError(path, kCannotBeWritten, error.error());
  }
  if (::rename(temporary.c_str(), target.c_str()) != 0) {
    const int error = errno;
    ::unlink(temporary.c_str());
    throw FileError(path, "cannot be replaced", error);
  }
  if (options.durability == Durability::kSynced) SyncFolder(target.parent_path());
}

bool ReserveFileName(const fs::path& path) {
  const OpenFile file(OpenNew(path, kReadableByAll));
  if (file.get() >= 0) return true;
  if (errno == EEXIST) return false;
  throw FileError(path, "cannot be created", errno);
}

bool IsStream(const fs::path& path) {
  if (OwnDescriptor(path)) return true;
  std::error_code error;
  const fs::file_type type = fs::status(path, error).type();
  return type != fs::file_type::regular && type != fs::file_type::not_found && type != fs::file_type::none;
}

int OpenToAppend(const fs::path& path, mode_t mode) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, mode);
  if (fd < 0) throw FileError(path, errno == ELOOP ? "is a symbolic link" : kCannotBeWritten, errno);
  struct stat status {};
  if (::fstat(fd, &status) == 0 && S_ISREG(status.st_mode) && status.st_nlink == 1) return fd;
  ::close(fd);
  throw FileError(path, "is no file of this program", EPERM);
}

int OpenOrCreate(const fs::path& path) {
  constexpr mode_t kMode = 0644;
  return ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kMode);
}

fs::path CreateTemporaryFile(const fs::path& folder, std::string_view prefix) {
  for (int i = 0; i < kAttempts; ++i) {
    fs::path path = folder / (std::string(prefix) + RandomDigits());
    const OpenFile file(OpenNew(path, kReadableByOwner));
    if (file.get() >= 0) return path;
    if (errno != EEXIST) throw FileError(path, "cannot be created", errno);
  }
  throw FileError(folder, "has no unused name", EEXIST);
}

}  // namespace legopt::files

namespace legopt {

void WriteOutputFile(const std::filesystem::path& path, std::string_view bytes, const files::WriteOptions& options) {
  try {
    files::ReplaceFile(path, bytes, options);
  } catch (const files::FileError& error) {
    if (error.shortage() || error.error() == EPIPE) throw;
    throw InputError({path.string(), "", "", error.reason(), ""});
  }
}

void CopyOutputFile(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::ifstream stream(from, std::ios::binary);
  if (!stream && files::IsShortage(errno)) throw std::system_error(errno, std::generic_category(), from.string());
  const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  std::error_code error;
  if (!stream.is_open() || stream.bad() || std::filesystem::is_directory(from, error)) {
    throw InputError({from.string(), "", "", "cannot be read", "check that the file exists and its permissions"});
  }
  std::filesystem::create_directories(to.parent_path(), error);
  WriteOutputFile(to, bytes, {files::kReadableByAll, files::Durability::kBuffered});
}

}  // namespace legopt
