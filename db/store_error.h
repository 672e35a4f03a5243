#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace legopt::db {

/// Error codes of the database. Each requires a different reaction of the caller.
enum class StoreErrorCode {
  kUnwritable,   ///< the file, its folder or its side files cannot be opened, created or written
  kNotFound,     ///< opened read-only, and the file does not exist
  kNewerSchema,  ///< written by a newer legopt; must not be modified
  kOlderSchema,  ///< opened read-only, so not upgraded; a server upgrades it when it starts
  kNotLegopt,    ///< not a SQLite file, or the database of another application
  kLocked,       ///< another legopt-server uses this database
  kFull,         ///< no space left; the transaction was rolled back and may be retried
  kIo,           ///< disk error; the transaction was rolled back and may be retried
  kCorrupt,      ///< the file is damaged: restore a backup
  kDisplaced,    ///< the file is no longer at its path; operation resumes when it is back
  kBusy,         ///< another connection held a lock for too long; may be retried
  kConstraint,   ///< an operation violates the schema: a bug in the caller
  kBadQuery,     ///< invalid SQL, or SQL that is not read-only
  kInterrupted,  ///< a query was interrupted or exceeded its time limit
  kShortage,     ///< out of memory or file descriptors
};

/// Returns "unwritable", "not_found", "newer_schema", ...
std::string_view ToString(StoreErrorCode code);

/// Exception of the db module. `what()` names the file, the problem and the remedy, ready to be printed.
class StoreError : public std::runtime_error {
 public:
  StoreError(StoreErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}

  StoreErrorCode code() const { return code_; }

  /// True for temporary states of a disk, file or lock (full, I/O error, displaced, busy): stop, keep the transaction
  /// and retry.
  bool transient() const {
    return code_ == StoreErrorCode::kFull || code_ == StoreErrorCode::kIo || code_ == StoreErrorCode::kDisplaced ||
           code_ == StoreErrorCode::kBusy;
  }

 private:
  StoreErrorCode code_;
};

}  // namespace legopt::db
