#pragma once

#include <cstdint>

namespace legopt::db {

/// A SQLite VFS on top of the system's own, the default during the lifetime of this object. Counts every call that
/// changes the disk (write, sync, truncate, delete, create) and can make it fail. One instance at a time; tests only.
class FaultyVfs {
 public:
  enum class Fault {
    kNone,
    kIoError,     ///< the call fails with an I/O error and has no effect
    kFull,        ///< the call fails for lack of space; a write leaves its first half behind
    kSyncFailed,  ///< only syncs are counted and fail
    kDie,         ///< the process ends before the call, as by kill -9; a write leaves its first half behind
  };

  FaultyVfs();
  ~FaultyVfs();
  FaultyVfs(const FaultyVfs&) = delete;
  FaultyVfs& operator=(const FaultyVfs&) = delete;

  /// Makes the calls number `first` .. `first` + `length` - 1, counted from 1, fail with `fault`.
  void Arm(Fault fault, std::int64_t first, std::int64_t length = 1);
  void Disarm();
  std::int64_t calls() const;   ///< since the last Arm or Disarm
  std::int64_t faults() const;  ///< number of these calls that failed
};

}  // namespace legopt::db
