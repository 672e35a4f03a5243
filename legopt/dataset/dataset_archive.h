#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "legopt/read_guard.h"

/// @file
/// A dataset as one sequence of bytes, to travel: docs/datasets.md, "Archives". Pure but for the files that they name.

namespace legopt {

/// Of an archive: what a body of the protocol may hold.
inline constexpr std::size_t kMostArchiveBytes = std::size_t{64} << 20;
/// Of what is in one, so that a few bytes cannot become a full disk.
inline constexpr std::size_t kMostUnpackedBytes = std::size_t{1} << 30;

/// Content hash of the dataset in `folder`, as Dataset::content_hash(), from the files as they are: what dataset.yaml
/// says of their hashes is not believed. Cheaper than loading it. Throws InputError.
std::string HashOfDataset(const std::filesystem::path& folder, const ReadGuard& guard);

/// All files of the dataset in `folder` that decide its content hash, and its name. Throws InputError, also when the
/// archive would be larger than kMostArchiveBytes.
std::string PackDataset(const std::filesystem::path& folder, const ReadGuard& guard);

/// Writes the files of an archive into `folder`, which must be empty. Throws InputError for paths that lead out of the
/// folder or are long, for sizes that do not fit, for more than kMostUnpackedBytes, for more than 64 MiB that unpack to
/// over 100 times the archive's size, and for a full disk. Files written before the fault remain. The archive's table
/// is parsed under `guard`; memory does not grow with the content.
void UnpackDataset(std::string_view packed, const std::filesystem::path& folder, const ReadGuard& guard);

}  // namespace legopt
