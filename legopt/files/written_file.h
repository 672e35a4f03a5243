#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string_view>

/// All files that the programs and the library create are created here: never through a planted link, never left half
/// written. Thread-safe. Linux only.
namespace legopt::files {

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
