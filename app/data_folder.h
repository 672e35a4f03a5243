#pragma once

#include <filesystem>
#include <vector>

namespace legopt::app {

/// Folder of the running program (see ProgramFile). Throws InputError if it is unknown.
std::filesystem::path ProgramFolder();

/// Folder with the embedded datasets and suites: the environment variable LEGOPT_DATA, else ../share/legopt/data next
/// to the program (installed), else the link legopt-data next to it or its folder (built). Throws InputError if none
/// exists. `legopt --help` and `legopt service doctor` print it.
std::filesystem::path DataFolder();

/// Folder of legopt's Python package for PYTHONPATH, next to DataFolder(); empty if it was not installed.
std::filesystem::path PythonFolder();

/// Folder of the embedded default dataset, inside DataFolder(). Throws InputError like it.
std::filesystem::path DefaultDatasetFolder();

/// Folders of all embedded datasets for experiments, the default one first. A user's DataFolder() need not contain the
/// others. Throws InputError like it.
std::vector<std::filesystem::path> EmbeddedDatasetFolders();

}  // namespace legopt::app
