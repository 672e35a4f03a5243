// Handles a database file that is no longer at its path: all acknowledged data is still reachable through the open
// file, and is saved to a place where users find it before the process ends.
#include <ctime>
#include <string>

#include "db/backup.h"
#include "db/sqlite_store_impl.h"

namespace legopt::db {
namespace {

using Place = DatabaseFile::Place;

std::string TimeStamp() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof(text), "%Y%m%dT%H%M%SZ", &utc);
  return text;
}

}  // namespace

void SqliteStore::CheckPlace() {
  const Place place = file_.Look();
  if (place != Place::kThere) ThrowDisplaced(place, Rescue(place));
  rescued_to_.clear();
}

void SqliteStore::ThrowDisplaced(Place place, const std::string& remedy) const {
  throw StoreError(StoreErrorCode::kDisplaced, file_.path().string() + ": " + file_.Describe(place) +
                                                   " while the server works on it" +
                                                   (remedy.empty() ? "" : "; " + remedy));
}

// Moves the whole log into the file, which was renamed or unlinked. Returns false if some of the log remains.
bool SqliteStore::CheckpointAll() {
  try {
    connection_.SetBusyTimeout(std::chrono::milliseconds(0));  // a reader must not block the server
    const bool all = connection_.QueryInt("PRAGMA wal_checkpoint(TRUNCATE)") == 0;
    connection_.SetBusyTimeout(Connection::kBusyTimeout);
    return all;
  } catch (const StoreError&) {
    connection_.SetBusyTimeout(Connection::kBusyTimeout);
    return false;
  }
}

// Saves all acknowledged data; returns a message with its location and what to do.
std::string SqliteStore::Rescue(Place place) {
  const bool whole = CheckpointAll();
  if (place == Place::kSideFile) {
    return whole ? "the database holds all acknowledged results; stop the server and start it again"
                 : "do not stop the server yet: its log is still being written into the database";
  }
  if (place == Place::kElsewhere) {
    return whole ? "it holds all acknowledged results; move it back and the server continues, or stop the server"
                 : "do not stop the server yet: its log is still being written into that file";
  }
  try {
    if (rescued_to_.empty()) {
      const std::filesystem::path copy = file_.path().string() + ".rescued-" + TimeStamp();
      BackUp(connection_, copy);
      rescued_to_ = copy;
    }
    return "all that was acknowledged was copied to " + rescued_to_.string() +
           "; stop the server, give the copy its old name and start the server again";
  } catch (const StoreError& error) {
    return std::string("it could not be copied (") + error.what() + "); before the server is stopped, " +
           (whole ? "save all that was acknowledged by 'cp " + file_.DescriptorPath() + " COPY'"
                  : "make room: its log is not in one file yet");
  }
}

}  // namespace legopt::db
