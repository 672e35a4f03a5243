#pragma once

#include <cstdint>

namespace legopt::db {

/// A SQLite VFS over the system's own, made the default while this object lives, that counts every call which changes
/// the disk (write, sync, truncate, delete, create) and can make it fail. One at a time; tests only.
class FaultyVfs {
 public:
  enum class Fault {
    kNone,
    kIoError,     ///< the call fails with an I/O error and does nothing
    kFull,        ///< it fails for lack of space; a write leaves its first half behind
    kSyncFailed,  ///< only syncs count and fail
    kDie,         ///< the process ends at once, as by kill -9, before the call; a write leaves its first half behind
  };

  FaultyVfs();
  ~FaultyVfs();
  FaultyVfs(const FaultyVfs&) = delete;
  FaultyVfs& operator=(const FaultyVfs&) = delete;

  /// From now on the calls number `first` .. `first` + `length` - 1 (counted from 1) suffer `fault`.
  void Arm(Fault fault, std::int64_t first, std::int64_t length = 1);
  void Disarm();
  std::int64_t calls() const;   ///< since the last Arm or Disarm
  std::int64_t faults() const;  ///< of these, made to fail
};

}  // namespace legopt::db
