#pragma once

#include <filesystem>
#include <string>

/// @file
/// The key of the workers of a pool: always a worker's key, so that a node can neither submit nor delete experiments.

namespace legopt::client {

/// Returns the contents of the worker's key file derived from a key file. Throws BusError (kInvalidOption) for an
/// unusable file and ClientError (kUsage) for a client's key, from which no worker's key can be derived.
std::string WorkerKeyText(const std::string& key_file);

/// Returns a worker's key file: `key_file` itself if it contains a worker's key, else "worker.key" in `folder`, created
/// if missing. Throws the errors of WorkerKeyText, and ClientError (kUsage) if that file contains another key.
std::filesystem::path WorkerKeyFile(const std::string& key_file, const std::filesystem::path& folder);

}  // namespace legopt::client
