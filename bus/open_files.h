#pragma once

#include <sys/types.h>

#include <map>
#include <set>
#include <utility>

/// @file
/// Finds the sockets and pipes that a library opens without exposing them. Private to bus.

namespace legopt::bus {

/// Device and inode of an open file. An inode, unlike a descriptor's number, is not reused soon after a close, so other
/// threads may open and close files while a library is observed.
using FileIdentity = std::pair<dev_t, ino_t>;

/// Returns the descriptors of this process's open sockets and pipes with their identities. Without /proc, it misses
/// descriptors more than 64 above the lowest free one. Thread-safe.
std::map<int, FileIdentity> OpenSocketsAndPipes();

/// Sockets and pipes that were open at construction. Thread-safe: constant.
class OpenFilesBefore {
 public:
  OpenFilesBefore();
  /// Returns the descriptors of sockets and pipes opened since construction, by any thread.
  std::set<int> OpenedSince() const;

 private:
  std::set<FileIdentity> files_;
};

}  // namespace legopt::bus
