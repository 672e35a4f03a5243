#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/pool/pool_file.h"

/// @file
/// What a pool consists of, in its folder: a file "jobs" with a line for each, "slurm 17" for an array of Slurm, "ssh
/// 4711 123456" for a process of 'legopt pool ssh' and the moment of its start, which tell it from a later one of its
/// number.

namespace legopt::client {

/// One line.
struct PoolMember {
  Engine engine;   ///< kSlurm or kSsh
  std::string id;  ///< "17", "4711 123456"
};

/// Throws ClientError (kUsage) when it cannot be written.
void AddToRecord(const std::filesystem::path& folder, const PoolMember& member);

/// In the order in which they were added. Throws ClientError (kUsage) when there is no such file, or it holds something
/// else.
std::vector<PoolMember> ReadRecord(const std::filesystem::path& folder);

}  // namespace legopt::client
