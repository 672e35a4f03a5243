#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "legopt/types/read_guard.h"

/// @file
/// Conversion between a dataset and a sequence of bytes, for transfer: docs/reference/datasets.md, "Archives".

namespace legopt {

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
