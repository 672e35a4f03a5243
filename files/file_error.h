#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace legopt::files {

/// True for the errors by which the machine, not the file, refuses: too many open files (EMFILE, ENFILE), no memory
/// (ENOMEM). Programs end with exit code 71 then.
bool IsShortage(int error);

/// The system's text for an error number, and what to do about it: "No space left on device; make room".
std::string Explain(int error);

/// The advice for a write that failed for a cause that is not known: names the limit on file sizes, if there is one,
/// else `usual`.
std::string WriteAdvice(const std::string& usual);

/// A file cannot be created, written or locked. what() is "PATH: CAUSE; FIX", ready to be printed.
class FileError : public std::runtime_error {
 public:
  /// "PATH: cannot be written: Permission denied; ..." for `action` "cannot be written".
  FileError(const std::filesystem::path& path, const std::string& action, int error);

  int error() const { return error_; }                   ///< errno
  const std::string& reason() const { return reason_; }  ///< text after the path
  bool shortage() const { return IsShortage(error_); }   ///< see IsShortage

 private:
  std::string reason_;
  int error_;
};

}  // namespace legopt::files
