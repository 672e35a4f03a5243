#pragma once

#include <filesystem>
#include <string>

#include "bus/lcm_transport.h"

namespace legopt::client {

/// @file
/// The key of the workers of a pool: always a worker's key, so that a node can neither submit nor delete experiments.

/// Returns the contents of the worker's key file derived from a key file. Throws BusError (kInvalidOption) for an
/// unusable file and ClientError (kUsage) for a client's key, from which no worker's key can be derived.
std::string WorkerKeyText(const std::string& key_file);

/// Returns a worker's key file: `key_file` itself if it contains a worker's key, else "worker.key" in `folder`, created
/// if missing. Throws the errors of WorkerKeyText, and ClientError (kUsage) if that file contains another key.
std::filesystem::path WorkerKeyFile(const std::string& key_file, const std::filesystem::path& folder);

/// Probes the addresses of an access file for some seconds, like a worker. Throws ClientError (kUnreachable) with the
/// addresses and the key file if no server answers under that key, and bus::BusError if the file cannot be read. Checks
/// nothing if this host has no multicast, not even loopback.
void RequireServer(const std::string& access_file, bus::LcmOptions network);

}  // namespace legopt::client
