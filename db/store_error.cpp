#include "db/store_error.h"

namespace legopt::db {

std::string_view ToString(StoreErrorCode code) {
  switch (code) {
    case StoreErrorCode::kUnwritable:
      return "unwritable";
    case StoreErrorCode::kNotFound:
      return "not_found";
    case StoreErrorCode::kNewerSchema:
      return "newer_schema";
    case StoreErrorCode::kOlderSchema:
      return "older_schema";
    case StoreErrorCode::kNotLegopt:
      return "not_legopt";
    case StoreErrorCode::kLocked:
      return "locked";
    case StoreErrorCode::kFull:
      return "full";
    case StoreErrorCode::kIo:
      return "io";
    case StoreErrorCode::kCorrupt:
      return "corrupt";
    case StoreErrorCode::kDisplaced:
      return "displaced";
    case StoreErrorCode::kBusy:
      return "busy";
    case StoreErrorCode::kConstraint:
      return "constraint";
    case StoreErrorCode::kBadQuery:
      return "bad_query";
    case StoreErrorCode::kInterrupted:
      return "interrupted";
    case StoreErrorCode::kShortage:
      return "shortage";
  }
  return "unknown";
}

}  // namespace legopt::db
