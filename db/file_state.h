#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace legopt::db {

class Connection;
class LockFile;

/// @file
/// The session of a database: an id in the table `file_state` that is new each time a server opens the file, and in
/// each backup. It shows whether the write-ahead log beside a file was written for that file. SQLite does not check
/// this: it would replace the file's pages by the log's.

/// The session as this connection sees it; empty before schema version 10.
std::optional<std::string> SessionOf(Connection& connection);

/// Throws StoreError (kCorrupt) when the file or its log is damaged (RequireSoundFiles), or when the log beside `file`
/// was written for another file, which happens when a backup is copied over a database whose server was killed. Nothing
/// is changed.
void RequireOwnLog(const std::filesystem::path& file);

/// Gives the database a new session and writes it to the file and to its lock file. If a reader prevents the log from
/// being moved into the file, the previous session is kept. The connection must be the only writer, and in no
/// transaction.
void BeginSession(Connection& connection, LockFile& lock);

/// Gives a copy a session of its own. Does nothing before schema version 10.
void RenewSession(Connection& copy);

}  // namespace legopt::db
