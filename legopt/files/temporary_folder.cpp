#include "legopt/files/temporary_folder.h"

#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>

#include "legopt/files/written_file.h"

namespace legopt::files {
namespace {

// Returns the variable that std::filesystem::temp_directory_path() uses; TMPDIR if none is set.
std::string VariableInUse() {
  for (const char* name : {"TMPDIR", "TMP", "TEMP", "TEMPDIR"}) {
    if (std::getenv(name) != nullptr) return name;
  }
  return "TMPDIR";
}

std::string Advice() { return ", or set " + VariableInUse() + " to another folder"; }

}  // namespace

std::filesystem::path FolderForTemporaryFiles() {
  std::error_code error;
  std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (!error) return folder;
  const std::string variable = VariableInUse();
  const char* const value = std::getenv(variable.c_str());
  throw FileError(value == nullptr ? "/tmp" : value, "cannot be the folder for temporary files (" + variable + ")",
                  error.value(), Advice());
}

std::filesystem::path CreateTemporaryFolder(std::string_view prefix) {
  std::string name = (FolderForTemporaryFiles() / (std::string(prefix) + "XXXXXX")).string();
  if (::mkdtemp(name.data()) == nullptr) throw FileError(name, "cannot be created", errno, Advice());
  return name;
}

std::filesystem::path CreateTemporaryFile(std::string_view prefix) {
  const std::filesystem::path folder = FolderForTemporaryFiles();
  try {
    return CreateTemporaryFile(folder, prefix);
  } catch (const FileError& error) {
    throw FileError(folder, "no temporary file can be created here", error.error(), Advice());
  }
}

}  // namespace legopt::files
