#pragma once

#include <filesystem>
#include <string_view>

namespace legopt::files {

/// Returns the system's folder for temporary files: TMPDIR, or else TMP, TEMP, TEMPDIR, /tmp. Throws FileError, which
/// names the variable, if there is no such folder. Thread-safe as long as no thread changes the environment.
std::filesystem::path FolderForTemporaryFiles();

/// Creates a folder with an unused name in FolderForTemporaryFiles(), accessible to its owner only. The caller removes
/// it. Throws FileError, which names the variable that chooses another folder.
std::filesystem::path CreateTemporaryFolder(std::string_view prefix);

/// Creates an empty file with an unused name in FolderForTemporaryFiles(), readable by its owner only. The caller
/// removes it. Throws FileError, which names the variable that chooses another folder.
std::filesystem::path CreateTemporaryFile(std::string_view prefix);

}  // namespace legopt::files
