#pragma once

#include <sys/types.h>

#include <map>
#include <set>
#include <utility>

/// @file
/// Finds the sockets and pipes that a library opens and does not show. Private to bus.

namespace legopt::bus {

/// Device and inode of an open file. Unlike its descriptor's number, an inode is not given to another socket or pipe
/// soon after a close, so other threads may open and close files while a library is observed.
using FileIdentity = std::pair<dev_t, ino_t>;

/// Descriptors of this process's open sockets and pipes, with the identity of each. Without /proc, descriptors more
/// than 64 above the lowest free one are not found. Thread-safe.
std::map<int, FileIdentity> OpenSocketsAndPipes();

/// The sockets and pipes that were open at construction. Thread-safe: constant.
class OpenFilesBefore {
 public:
  OpenFilesBefore();
  /// The descriptors of sockets and pipes opened since, by this thread or another one.
  std::set<int> OpenedSince() const;

 private:
  std::set<FileIdentity> files_;
};

}  // namespace legopt::bus
