#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string_view>

/// Every file that the programs and the library create is created here: never through a planted link, never half
/// written. Thread-safe. Linux.
namespace legopt::files {

inline constexpr mode_t kReadableByAll = 0666;    ///< before the umask
inline constexpr mode_t kReadableByOwner = 0600;  ///< keys, access files

/// Whether a written file has to survive a power failure.
enum class Durability {
  kSynced,    ///< on the disk before the function returns
  kBuffered,  ///< scratch files, files of a folder that is still incomplete
};

/// How a file is written.
struct WriteOptions {
  mode_t mode = kReadableByAll;                 ///< permissions of a new file
  Durability durability = Durability::kSynced;  ///< whether to sync it
};

/// A file that does not exist yet, written in pieces. The destructor removes it unless Finish was called. Not
/// thread-safe.
class NewFile {
 public:
  /// Creates it. Throws FileError (EEXIST: something has that name, also a dangling link).
  explicit NewFile(std::filesystem::path path, const WriteOptions& options = {});
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  /// Appends bytes. Throws FileError.
  void Write(std::string_view bytes);
  /// The file is complete and stays. Throws FileError when it cannot be synced.
  void Finish();

 private:
  std::filesystem::path path_;
  Durability durability_;
  int fd_ = -1;
};

/// Creates a file that does not exist. A file that could not be written whole is removed. Throws FileError (EEXIST:
/// something has that name, also a dangling link).
void CreateFile(const std::filesystem::path& path, std::string_view bytes, const WriteOptions& options = {});

/// Writes a file. A regular file, or none, is replaced in one step by a temporary file of the same folder, so that a
/// failure changes nothing; symbolic links in `path` are followed and stay. Streams (IsStream) are
/// written to directly. Throws FileError.
void ReplaceFile(const std::filesystem::path& path, std::string_view bytes, const WriteOptions& options = {});

/// Creates an empty file; false if something has that name already. The file reserves the name for this process. Throws
/// FileError for any other failure.
bool ClaimName(const std::filesystem::path& path);

/// True for what exists and is no regular file (a device, a pipe), and for the names of this process's own descriptors
/// (/dev/stdout, /dev/fd/3).
bool IsStream(const std::filesystem::path& path);

/// Opens a regular file for appending, or creates it; the caller closes the descriptor. Refuses links. Throws
/// FileError.
int OpenToAppend(const std::filesystem::path& path, mode_t mode);

/// Opens a file for reading and writing, or creates it, following links; the caller closes the descriptor. For files
/// that the user has named and another library writes. -1 and errno if that fails.
int OpenOrCreate(const std::filesystem::path& path);

/// Creates an empty file of an unused name, readable by its owner alone, in `folder`; the caller removes it. Throws
/// FileError.
std::filesystem::path CreateTemporaryFile(const std::filesystem::path& folder, std::string_view prefix);

}  // namespace legopt::files
