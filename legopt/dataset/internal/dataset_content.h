#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/geometry/scene.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/read_guard.h"

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

// Conversion between a dataset and a sequence of bytes, for transfer: docs/reference/datasets.md, "Archives".

/// Maximum size of an archive: the size limit of a protocol message body.
inline constexpr std::size_t kMaxArchiveBytes = std::size_t{64} << 20;
/// Maximum unpacked size, so that a small archive cannot fill the disk.
inline constexpr std::size_t kMaxUnpackedBytes = std::size_t{1} << 30;

/// Computes the content hash of the dataset in `folder`, equal to Dataset::content_hash(), from the present files;
/// ignores the hashes listed in dataset.yaml. Cheaper than loading the dataset. Throws InputError.
std::string HashOfDataset(const std::filesystem::path& folder, const ReadGuard& guard);

/// Packs all files that determine the content hash of the dataset in `folder`, and its name. Throws InputError, also if
/// the archive would exceed kMaxArchiveBytes.
std::string PackDataset(const std::filesystem::path& folder, const ReadGuard& guard);

/// Unpacks an archive into `folder`, which must be empty. Throws InputError for paths that are too long or lead out of
/// the folder, inconsistent sizes, more than kMaxUnpackedBytes, more than 64 MiB that unpack to over 100 times the
/// archive's size, and a full disk. Files written before the error remain. The archive's table is parsed under `guard`;
/// memory does not grow with the content.
void UnpackDataset(std::string_view packed, const std::filesystem::path& folder, const ReadGuard& guard);

}  // namespace legopt
