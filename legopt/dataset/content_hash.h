#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "legopt/collision/scene.h"
#include "legopt/dataset/dataset_file.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// BLAKE2b-256 of a file's bytes, 64 lower-case hex digits. Throws InputError when it cannot be read.
std::string HashFile(const std::filesystem::path& path);

/// One used file: path inside the dataset folder (forward slashes) and BLAKE2b-256 of its bytes, hex.
struct FileHash {
  std::string path;  ///< inside the dataset's folder, forward slashes
  std::string hash;  ///< 64 lower-case hexadecimal digits
};

/// Paths inside `folder` of everything the dataset reads: robot, collision meshes, scene, scene meshes, problem files.
/// Sorted, each once. Throws InputError for a mesh that lies outside the folder.
std::vector<std::string> UsedFiles(const std::filesystem::path& folder, const DatasetDescription& description,
                                   const RobotModel& robot, const Scene& scene);

/// Hashes of UsedFiles of the dataset in `folder` (with dataset.yaml or bare), sorted by path; ignores the hashes that
/// dataset.yaml states. The robot is read under `guard`. Throws InputError for missing or malformed files.
std::vector<FileHash> ComputeManifest(const std::filesystem::path& folder, const ReadGuard& guard = {});

/// Replaces the `files:` block of `folder`/dataset.yaml by ComputeManifest(folder), or appends it; everything else,
/// comments included, stays as it is. The file is replaced in one step. Returns the manifest written. Throws InputError
/// (no dataset.yaml, unwritable folder).
std::vector<FileHash> WriteManifestHashes(const std::filesystem::path& folder, const ReadGuard& guard = {});

/// The hash that names a dataset: BLAKE2b-256 of a canonical text (JSON, sorted keys, shortest round-trip numbers) of
/// the description, name left out, and the manifest.
std::string ContentHash(const DatasetDescription& description, const std::vector<FileHash>& manifest);

}  // namespace legopt
