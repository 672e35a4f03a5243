#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "legopt/dataset/dataset_file.h"
#include "legopt/geometry/scene.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Returns the BLAKE2b-256 of a file's bytes, 64 lower-case hex digits. Throws InputError if the file cannot be read.
std::string HashFile(const std::filesystem::path& path);

/// Hash of one file that the dataset uses.
struct FileHash {
  std::string path;  ///< relative to the dataset's folder, forward slashes
  std::string hash;  ///< BLAKE2b-256 of its bytes, 64 lower-case hexadecimal digits
};

/// Returns the paths of all files that the dataset reads, relative to `folder`: robot, collision meshes, scene, scene
/// meshes, problem files. Sorted and unique. Throws InputError for a mesh outside the folder.
std::vector<std::string> ListUsedFiles(const std::filesystem::path& folder, const DatasetDescription& description,
                                       const RobotModel& robot, const Scene& scene);

/// Computes the hashes of ListUsedFiles for the dataset in `folder` (with or without dataset.yaml), sorted by path;
/// ignores the hashes listed in dataset.yaml. The robot is read under `guard`. Throws InputError for missing or
/// malformed files.
std::vector<FileHash> ComputeManifest(const std::filesystem::path& folder, const ReadGuard& guard = {});

/// Replaces the `files:` block of `folder`/dataset.yaml by ComputeManifest(folder), or appends it; the rest of the
/// file, including comments, is unchanged. The file is replaced atomically. Returns the new manifest. Throws InputError
/// if there is no dataset.yaml or the folder is read-only.
std::vector<FileHash> WriteManifestHashes(const std::filesystem::path& folder, const ReadGuard& guard = {});

/// Computes the content hash of a dataset: BLAKE2b-256 of a canonical text (JSON, sorted keys, shortest round-trip
/// numbers) of the manifest and the description without its name.
std::string ContentHash(const DatasetDescription& description, const std::vector<FileHash>& manifest);

}  // namespace legopt
