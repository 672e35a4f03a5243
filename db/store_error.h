#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace legopt::db {

/// Why the database refused. Each code asks something different of the caller.
enum class StoreErrorCode {
  kUnwritable,   ///< the file, its folder or its side files cannot be opened, created or written
  kNotFound,     ///< opened read-only, and there is no such file
  kNewerSchema,  ///< written by a newer legopt; this one must not touch it
  kOlderSchema,  ///< opened read-only and never upgraded; a server upgrades it when it starts
  kNotLegopt,    ///< not a SQLite file, or the database of another program
  kLocked,       ///< another legopt-server works on this database
  kFull,         ///< no space left; the transaction was rolled back and may be tried again
  kIo,           ///< the disk failed; the transaction was rolled back and may be tried again
  kCorrupt,      ///< the file is damaged: restore a backup
  kDisplaced,    ///< the file is not at its path any more; goes on when it is back
  kBusy,         ///< another connection held a lock for too long; may be tried again
  kConstraint,   ///< an operation would have made an illegal row: a defect of the caller
  kBadQuery,     ///< SQL that is wrong or not read-only
  kInterrupted,  ///< a query was interrupted or exceeded its time limit
  kShortage,     ///< the machine has no memory, or this process no descriptors, left
};

/// "unwritable", "not_found", "newer_schema", ...
std::string_view ToString(StoreErrorCode code);

/// The typed error of the db room. `what()` names the file, what is wrong and what to do, ready to be printed.
class StoreError : public std::runtime_error {
 public:
  StoreError(StoreErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}

  StoreErrorCode code() const { return code_; }

  /// True for the states of a disk, file or lock that can pass (full, I/O error, displaced, busy): stop, keep the
  /// transaction, try again.
  bool transient() const {
    return code_ == StoreErrorCode::kFull || code_ == StoreErrorCode::kIo || code_ == StoreErrorCode::kDisplaced ||
           code_ == StoreErrorCode::kBusy;
  }

 private:
  StoreErrorCode code_;
};

}  // namespace legopt::db
