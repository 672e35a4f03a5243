#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace legopt::db {

class Connection;
class LockFile;

/// @file
/// The session of a database: an id in the table `file_state` that changes each time a server opens the file, and in
/// each backup. It shows whether the write-ahead log beside a file was written for that file. SQLite does not check
/// this; it would overwrite pages of the file with pages of a foreign log.

/// Returns the session that this connection sees; nullopt before schema version 10.
std::optional<std::string> SessionOf(Connection& connection);

/// Throws StoreError (kCorrupt) if the file or its log is damaged (RequireSoundFiles), or if the log beside `file` was
/// written for another file. The latter happens when a backup is copied over a database whose server was killed.
/// Changes nothing.
void RequireOwnLog(const std::filesystem::path& path);

/// Assigns a new session and writes it to the database and to its lock file. If a reader prevents the log from being
/// moved into the file, the previous session is kept. The connection must be the only writer and have no open
/// transaction.
void BeginSession(Connection& connection, LockFile& lock);

/// Assigns a new session to a copy. Does nothing before schema version 10.
void RenewSession(Connection& copy);

}  // namespace legopt::db
