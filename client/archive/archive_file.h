#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "client/archive/archive.h"

namespace legopt::client {

/// Largest archive, and largest text that it may unpack to.
inline constexpr std::size_t kMaxArchiveBytes = std::size_t{512} << 20, kMaxArchiveText = std::size_t{2} << 30;

/// Returns the bytes of an archive: the line "legopt-archive 1 HASH", where HASH is BLAKE2b-256 of all that follows; a
/// line of JSON that describes the experiment; and the results, a line of JSON each, compressed by zstd. Equal archives
/// have equal bytes. Throws ClientError (kUsage) for more text than a reader accepts.
std::string EncodeArchive(const Archive& archive);

/// Reads the bytes of an archive. `source`: name for errors. Throws InputError for bytes that are no archive, another
/// hash, another format, keys that are missing, unknown or out of range, indices and problems that are not declared, a
/// build without id, and two results of one job.
Archive DecodeArchive(std::string_view bytes, const std::string& source);

/// Reads an archive file. Throws the errors of DecodeArchive, and InputError for a file that cannot be read or is too
/// large.
Archive ReadArchive(const std::filesystem::path& path);

}  // namespace legopt::client
