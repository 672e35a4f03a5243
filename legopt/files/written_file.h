#pragma once

#include <sys/types.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace legopt::files {

/// Returns whether the error is a shortage of the machine, not a fault of the file: too many open files (EMFILE,
/// ENFILE) or no memory (ENOMEM). Programs end with exit code 71 then.
bool IsShortage(int error);

/// Returns the system's text for an error number and a remedy: "No space left on device; make room".
std::string Explain(int error);

/// Returns the advice for a write that failed for an unknown reason: the limit on file sizes, if there is one, else
/// `usual`.
std::string WriteAdvice(const std::string& usual);

/// Error: a file cannot be created, written or locked. what() is "PATH: CAUSE; FIX", ready to be printed.
class FileError : public std::runtime_error {
 public:
  /// "PATH: cannot be written: Permission denied; ..." for `action` "cannot be written". `advice` is added at the end.
  FileError(const std::filesystem::path& path, const std::string& action, int error, const std::string& advice = "");

  int error() const { return error_; }                   ///< errno
  const std::string& reason() const { return reason_; }  ///< text after the path
  bool shortage() const { return IsShortage(error_); }

 private:
  std::string reason_;
  int error_;
};

/// All files that the programs and the library create are created here: never through a planted link, never left half
/// written. Thread-safe. Linux only.

inline constexpr mode_t kReadableByAll = 0666;    ///< mode before the umask
inline constexpr mode_t kReadableByOwner = 0600;  ///< mode of keys and access files

/// Whether a written file must survive a power failure.
enum class Durability {
  kSynced,    ///< synced to disk before the function returns
  kBuffered,  ///< not synced: scratch files and files of an incomplete folder
};

/// Options for writing a file.
struct WriteOptions {
  mode_t mode = kReadableByAll;  ///< permissions of a new file
  Durability durability = Durability::kSynced;
};

/// A file that does not exist yet, written in pieces. The destructor removes it unless Finish was called. Not
/// thread-safe.
class NewFile {
 public:
  /// Creates the file. Throws FileError (EEXIST: the name is in use, even by a dangling link).
  explicit NewFile(std::filesystem::path path, const WriteOptions& options = {});
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  /// Appends bytes. Throws FileError.
  void Write(std::string_view bytes);
  /// Marks the file as complete, so that it stays. Throws FileError if it cannot be synced.
  void Finish();

 private:
  std::filesystem::path path_;
  Durability durability_;
  int fd_ = -1;
};

/// Creates a new file with `bytes`. Removes the file if it cannot be written completely. Throws FileError (EEXIST: the
/// name is in use, even by a dangling link).
void CreateFile(const std::filesystem::path& path, std::string_view bytes, const WriteOptions& options = {});

/// Writes a file. Creates or replaces a regular file in one step by renaming a temporary file in the same folder, so
/// that a failure changes nothing. Symbolic links in `path` are followed and stay. Streams (IsStream) are written
/// directly. Throws FileError.
void ReplaceFile(const std::filesystem::path& path, std::string_view bytes, const WriteOptions& options = {});

/// Creates an empty file, which reserves the name for this process. Returns false if the name is in use. Throws
/// FileError for any other failure.
bool ReserveFileName(const std::filesystem::path& path);

/// Returns true for an existing path that is no regular file (a device, a pipe) and for the names of this process's own
/// descriptors (/dev/stdout, /dev/fd/3).
bool IsStream(const std::filesystem::path& path);

/// Opens a regular file for appending, or creates it. Refuses links. The caller closes the descriptor. Throws
/// FileError.
int OpenToAppend(const std::filesystem::path& path, mode_t mode);

/// Opens a file for reading and writing, or creates it; follows links. The caller closes the descriptor. Used for files
/// that the user has named and another library writes. Returns -1 and sets errno on failure.
int OpenOrCreate(const std::filesystem::path& path);

/// Creates an empty file with an unused name in `folder`, readable by its owner only. The caller removes it. Throws
/// FileError.
std::filesystem::path CreateTemporaryFile(const std::filesystem::path& folder, std::string_view prefix);

}  // namespace legopt::files

namespace legopt {

/// Writes a file atomically with files::ReplaceFile. Throws InputError with file, cause and fix; files::FileError if
/// memory or file descriptors are exhausted, or if `path` is a pipe whose reading end is closed (EPIPE).
void WriteOutputFile(const std::filesystem::path& path, std::string_view bytes,
                     const files::WriteOptions& options = {});

/// Copies a file and creates the parent folders of `to`. Throws like WriteOutputFile.
void CopyOutputFile(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace legopt
