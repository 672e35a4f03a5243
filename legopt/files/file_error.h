#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

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
  /// "PATH: cannot be written: Permission denied; ..." for `action` "cannot be written".
  FileError(const std::filesystem::path& path, const std::string& action, int error);

  int error() const { return error_; }                   ///< errno
  const std::string& reason() const { return reason_; }  ///< text after the path
  bool shortage() const { return IsShortage(error_); }

 private:
  std::string reason_;
  int error_;
};

}  // namespace legopt::files
