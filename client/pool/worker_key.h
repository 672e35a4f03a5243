#pragma once

#include <filesystem>
#include <string>

/// @file
/// The key that the workers of a pool get: always the worker's, so that a node can neither submit nor delete.

namespace legopt::client {

/// Content of the key file for workers that belongs to a key file. Throws BusError (kInvalidOption) for an unusable
/// file and ClientError (kUsage) for a client's key, from which no worker's key follows.
std::string WorkerKeyText(const std::string& key_file);

/// The same as a file: `key_file` itself if it holds a worker's key, else "worker.key" in `folder`, created if missing.
/// Throws as WorkerKeyText, and ClientError (kUsage) if that file holds another key.
std::filesystem::path WorkerKeyFile(const std::string& key_file, const std::filesystem::path& folder);

}  // namespace legopt::client
