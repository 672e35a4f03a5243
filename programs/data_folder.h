#pragma once

#include <filesystem>
#include <vector>

namespace legopt::programs {

/// Folder of the running program (see ProgramFile). Throws InputError when it is unknown.
std::filesystem::path ProgramFolder();

/// The folder with the embedded datasets and suites: the environment variable LEGOPT_DATA, else ../share/legopt/data
/// beside the program (where it was installed), else the link legopt-data beside it or its folder (where it was built).
/// Throws InputError when none exists. `legopt --help` and `legopt doctor` tell which one it is.
std::filesystem::path DataFolder();

/// The folder of legopt's Python package, as PYTHONPATH takes it, beside DataFolder(); empty where it was not
/// installed.
std::filesystem::path PythonFolder();

/// The embedded default dataset, inside DataFolder(). Throws as it does.
std::filesystem::path DefaultDatasetFolder();

/// All embedded datasets that experiments are made on, the default one first; a DataFolder() of one's own need not have
/// the others. Throws as it does.
std::vector<std::filesystem::path> EmbeddedDatasetFolders();

}  // namespace legopt::programs
