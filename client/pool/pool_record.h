#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/pool/pool_file.h"

/// @file
/// The members of a pool, recorded in its folder: a file "jobs" with one line each, "slurm 17" for a Slurm array, "ssh
/// 4711 123456" for a process of 'legopt pool ssh' and its start time, which distinguishes it from a later process with
/// the same id.

namespace legopt::client {

/// A line of the record.
struct PoolMember {
  Engine engine;   ///< kSlurm or kSsh
  std::string id;  ///< "17", "4711 123456"
};

/// Appends a member. Throws ClientError (kUsage) if the file cannot be written.
void AddToRecord(const std::filesystem::path& folder, const PoolMember& member);

/// Returns the members in the order of addition. Throws ClientError (kUsage) if the file is missing or has other
/// contents.
std::vector<PoolMember> ReadRecord(const std::filesystem::path& folder);

}  // namespace legopt::client
