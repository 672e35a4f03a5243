"""One SQLite file, read and never written: none of its bytes change, and no side file is created unless another process
uses it."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import sqlite3
import tempfile
import time
import urllib.parse
from collections.abc import Sequence
from typing import Any

from .errors import DatabaseError, RequestError
from .rows import Rows
from .schema_digests import SCHEMA_DIGESTS, SCHEMA_VERSION

APPLICATION_ID = 0x4C474F50  # "LGOP"
_OLDEST_UPGRADABLE = 9
_OLDEST_SQLITE = (3, 37)  # the first that supports STRICT tables; earlier ones report a malformed schema

_INSTRUCTIONS_PER_CHECK = 10_000

# Comments, quoted texts and single characters of SQL.
_TOKEN = re.compile(r"--[^\n]*|/\*.*?(?:\*/|$)|'[^']*'?|\"[^\"]*\"?|`[^`]*`?|\[[^\]]*\]?|.", re.DOTALL)

_READING = {sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ, sqlite3.SQLITE_RECURSIVE, sqlite3.SQLITE_FUNCTION}
_FORBIDDEN = {sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_PERM}
_DESCRIBING = {"table_info", "table_xinfo", "table_list", "index_list", "index_info", "foreign_key_list"}


def _authorize(action: int, first: str | None, second: str | None, *_: str | None) -> int:
    """Called by SQLite while it compiles a statement. mode=ro protects only the file: ATTACH could create another
    one."""
    if action == sqlite3.SQLITE_PRAGMA:
        return sqlite3.SQLITE_OK if first in _DESCRIBING else sqlite3.SQLITE_DENY
    if action == sqlite3.SQLITE_FUNCTION and second == "load_extension":
        return sqlite3.SQLITE_DENY
    return sqlite3.SQLITE_OK if action in _READING else sqlite3.SQLITE_DENY


class ReadOnlyFile:
    """SELECT on one legopt database.

    SQLite creates the side files -wal and -shm even for readers, and leaves them. So a file without them is opened as
    immutable, i.e. without locks. Before and after each statement the file is checked for a writer; if there is one,
    the statement runs again with locks. If a log must be read in a folder that cannot be written, file and log are read
    in a private copy.

    `limit_s`: seconds after which a statement is stopped; None for no limit.
    """

    def __init__(self, path: str | os.PathLike[str], limit_s: float | None = None):
        self.path = os.fspath(path)
        self.limit_s = limit_s
        self._deadline: float | None = None
        if sqlite3.sqlite_version_info < _OLDEST_SQLITE:
            raise DatabaseError(f"this Python has SQLite {sqlite3.sqlite_version}; legopt databases need 3.37 or "
                                "newer, as Python has on Debian 12")
        if not os.path.exists(self.path):
            raise DatabaseError(f"{self.path}: no such database; check the path")
        if not os.path.isfile(self.path):
            raise DatabaseError(f"{self.path}: not a file; name the database file")
        self._real_path = os.path.realpath(self.path)  # SQLite searches side files there
        self._connection: sqlite3.Connection | None = None
        self._seen: tuple[int, ...] | None = None
        self._connect()
        try:
            self._require_legopt()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Closes the file; may be called again."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def select(self, sql: str, parameters: Sequence[Any] | dict[str, Any] = ()) -> Rows:
        """Returns the rows of a statement of this package. DatabaseError if the file cannot be read, or is not
        intact."""
        try:
            return self._run(sql, parameters)
        except sqlite3.Error as error:
            raise self._fault(error) from error

    def query(self, sql: str, parameters: Sequence[Any] | dict[str, Any] = ()) -> Rows:
        """Returns the rows of a caller's statement. RequestError if it is wrong, or no SELECT; DatabaseError as
        above."""
        try:
            rows = self._run(sql, parameters)
            if not rows.columns:
                raise RequestError("empty SQL; give one SELECT")
            return rows
        except (sqlite3.ProgrammingError, sqlite3.InterfaceError, sqlite3.Warning) as error:
            raise RequestError(f"bad SQL: {error}") from error
        except sqlite3.Error as error:
            if error.sqlite_errorcode == sqlite3.SQLITE_AUTH:
                raise RequestError("only SELECT is allowed here: the database is read-only") from error
            if error.sqlite_errorcode == sqlite3.SQLITE_ERROR:
                raise RequestError(f"bad SQL: {error}; tables and views: {', '.join(self._tables())}") from error
            raise self._fault(error) from error

    # --- SQLite ----------------------------------------------------------------------------------------------------

    def _run(self, sql: str, parameters: Sequence[Any] | dict[str, Any]) -> Rows:
        if self._connection is None:
            raise DatabaseError(f"{self.path}: closed; open it again")
        while True:
            if self._changed():
                self._connect()
            self._deadline = None if self.limit_s is None else time.monotonic() + self.limit_s
            try:
                rows = self._fetch(sql, parameters)
            except sqlite3.Error:
                if not self._changed():
                    raise
            else:
                if not self._changed():
                    return rows

    def _is_too_late(self) -> bool:
        return self._deadline is not None and time.monotonic() > self._deadline

    def _fetch(self, sql: str, parameters: Sequence[Any] | dict[str, Any]) -> Rows:
        with contextlib.closing(self._connection.execute(sql, parameters)) as cursor:
            names = _distinct([column[0] for column in cursor.description or ()])
            return Rows(names, (dict(zip(names, row)) for row in cursor))

    def _in_use(self) -> bool:
        return any(os.path.exists(self._real_path + suffix) for suffix in ("-wal", "-journal"))

    def _stamp(self) -> tuple[int, ...]:
        facts = os.stat(self._real_path)
        return (facts.st_dev, facts.st_ino, facts.st_size, facts.st_mtime_ns)

    def _changed(self) -> bool:
        """Returns whether a file opened as immutable has changed."""
        if self._seen is None:
            return False
        try:
            return self._in_use() or self._stamp() != self._seen
        except OSError as error:
            raise DatabaseError(f"{self.path}: cannot be read any more ({error.strerror}); open it again") from error

    def _connect(self) -> None:
        if self._connection is not None:
            self._connection.close()
        try:
            self._seen = None if self._in_use() else self._stamp()
            mode = "mode=ro" if self._seen is None else "mode=ro&immutable=1"
            self._require_own_log()
            self._connection = self._open(mode)
            self._connection.set_progress_handler(self._is_too_late, _INSTRUCTIONS_PER_CHECK)
            self._connection.text_factory = lambda text: text.decode("utf-8", "replace")
            self._connection.execute("PRAGMA query_only = 1")
            # The first use of a table-valued function looks like a change to the authorizer.
            for function in ("json_each('[]')", "json_tree('[]')", *(f"pragma_{name}('jobs')" for name in _DESCRIBING)):
                self._connection.execute(f"SELECT 1 FROM {function}").fetchall()
            self._connection.set_authorizer(_authorize)
        except (sqlite3.Error, OSError) as error:
            raise self._fault(error) from error

    def _would_leave_side_files(self) -> bool:
        """As db/file_state.h: a -shm of the reader would lock the owner's server out."""
        return os.geteuid() not in (0, os.stat(self._real_path).st_uid) and not os.path.exists(self._real_path + "-shm")

    def _open(self, mode: str) -> sqlite3.Connection:
        if "immutable" not in mode and self._would_leave_side_files():
            return self._open_copy()
        connection = sqlite3.connect(_uri(self._real_path, mode), uri=True, isolation_level=None)
        try:
            connection.execute("PRAGMA user_version").fetchall()  # the first read opens the side files
            return connection
        except sqlite3.Error as error:
            connection.close()
            if error.sqlite_errorcode & 0xFF not in _FORBIDDEN or not os.access(self._real_path, os.R_OK):
                raise
        return self._open_copy()

    def _open_copy(self) -> sqlite3.Connection:
        """Opens a copy of file and log; SQLite can read them after their names are removed."""
        with tempfile.TemporaryDirectory(prefix="legopt-read-") as folder:
            copy = os.path.join(folder, "copy.sqlite")
            while True:
                stamp = self._stamp()
                for suffix in ("", "-wal"):
                    shutil.copyfile(self._real_path + suffix, copy + suffix)
                if stamp == self._stamp():
                    break
            connection = sqlite3.connect(_uri(copy, "mode=ro"), uri=True, isolation_level=None)
            connection.execute("PRAGMA user_version").fetchall()
            return connection

    def _require_own_log(self) -> None:
        """Raises if the log belongs to another file, like db/file_state.h: SQLite would apply its pages to any file."""
        def sessions() -> list[str]:
            try:
                with open(self._real_path + ".lock", encoding="ascii", errors="replace") as lock:
                    return [line.split()[1] for line in lock if line.startswith("session ")]
            except OSError:
                return []

        def session_of(mode: str) -> str | None:
            whole = "immutable" not in mode and self._would_leave_side_files()
            with contextlib.closing(self._open_copy() if whole else
                                    sqlite3.connect(_uri(self._real_path, mode), uri=True)) as connection:
                try:
                    return connection.execute("SELECT session FROM file_state").fetchone()[0]
                except (sqlite3.Error, TypeError):
                    return None

        log = self._real_path + "-wal"
        while os.path.exists(log) and os.path.getsize(log) > 0:
            named, in_file = sessions(), session_of("mode=ro&immutable=1")
            if named != sessions():
                continue  # a server is starting at this moment
            foreign = in_file not in named if named else None not in (in_file, session_of("mode=ro")) and (
                in_file != session_of("mode=ro"))
            if foreign:
                raise DatabaseError(f"{self.path}: the log {log} beside it was written for another file (was a backup "
                                    "copied over a database?); to restore a backup: 'legopt service restore BACKUP --db FILE'")
            return

    def _require_schema(self) -> None:
        """Applies the rule of RequireIntact in db/migrations.h."""
        found, unexpected = set(), []
        tables = {name.removeprefix("table ") for name in SCHEMA_DIGESTS if name.startswith("table ")}
        for kind, name, table, sql in self._connection.execute(
                "SELECT type, name, tbl_name, sql FROM sqlite_schema WHERE sql IS NOT NULL AND NOT (type = 'table' AND "
                "name IN ('sqlite_sequence', 'sqlite_stat1', 'sqlite_stat4'))").fetchall():
            entry = f"{kind} {name}"
            if SCHEMA_DIGESTS.get(entry) == digest_of(sql):
                found.add(entry)
            elif entry in SCHEMA_DIGESTS:
                unexpected.append(f"{kind} '{name}' is not that of schema version {SCHEMA_VERSION}")
            elif kind == "trigger" or (kind == "index" and table in tables and sql.startswith("CREATE UNIQUE")):
                unexpected.append(f"{kind} '{name}' on table '{table}' is not legopt's")
        missing = [entry for entry in SCHEMA_DIGESTS if entry not in found]
        fault = unexpected[0] if unexpected else f"{missing[0]} is missing" if missing else ""
        if fault:
            advice = f"start 'legopt-server --db {self.path}' once, it restores the view" if fault.startswith("view ") \
                else "restore a backup"
            raise DatabaseError(f"{self.path}: not an intact legopt database: {fault}; {advice}")

    def _require_legopt(self) -> None:
        connection = self._connection
        connection.set_authorizer(None)
        try:
            ((application,),) = connection.execute("PRAGMA application_id").fetchall()
            ((version,),) = connection.execute("PRAGMA user_version").fetchall()
            ((things,),) = connection.execute("SELECT count(*) FROM sqlite_schema").fetchall()
        except sqlite3.Error as error:
            raise self._fault(error) from error
        if things == 0 and application == 0:
            raise DatabaseError(f"{self.path}: empty, not a legopt database; check the path")
        if application != APPLICATION_ID:
            raise DatabaseError(f"{self.path}: this is the database of another program (application_id {application}); "
                                "choose another file")
        if version < _OLDEST_UPGRADABLE:
            raise DatabaseError(f"{self.path}: written by an old legopt (schema {version}, the server upgrades schema "
                                f"{_OLDEST_UPGRADABLE} and newer); upgrade it first with an earlier legopt, built from "
                                "sources of 24 to 27 November 2026: start its legopt-server --db on the file once")
        if version < SCHEMA_VERSION:
            raise DatabaseError(f"{self.path}: written by an older legopt (schema {version}); start "
                                f"'legopt-server --db {self.path}' once, it upgrades the file")
        if version > SCHEMA_VERSION:
            raise DatabaseError(f"{self.path}: written by a newer legopt (schema {version}, this package knows "
                                f"{SCHEMA_VERSION}); use the Python package of that legopt")
        try:
            self._require_schema()
        except sqlite3.Error as error:
            raise self._fault(error) from error
        connection.set_authorizer(_authorize)

    def _tables(self) -> list[str]:
        return self.select("SELECT name FROM sqlite_schema WHERE type IN ('view', 'table') AND name NOT GLOB "
                           "'sqlite_*' ORDER BY type DESC, name").column("name")

    def _fault(self, error: Exception) -> DatabaseError:
        code = getattr(error, "sqlite_errorcode", None)
        advice = "'legopt service doctor --db FILE' checks the database"
        primary = None if code is None else code & 0xFF
        if primary == sqlite3.SQLITE_CORRUPT:
            advice = "the file is damaged; restore a backup"
        if isinstance(error, OSError) or primary in _FORBIDDEN:
            advice = "check the permissions of file and folder; 'legopt service backup' makes a copy that needs no side files"
        elif isinstance(error, sqlite3.ProgrammingError):
            advice = "use a database in the thread that opened it"
        elif primary == sqlite3.SQLITE_NOTADB:
            advice = "this is not a SQLite file; choose another file"
        elif primary == sqlite3.SQLITE_INTERRUPT:
            return DatabaseError(f"{self.path}: the query was stopped after {self.limit_s:g} s; ask for less, or allow "
                                 "more with limit_s")
        elif primary == sqlite3.SQLITE_BUSY:
            advice = "another program holds a lock on the file; try again"
        return DatabaseError(f"{self.path}: {error}; {advice}")


def digest_of(sql: str) -> str:
    """Returns a digest as in SCHEMA_DIGESTS. It does not depend on comments and white space, like DiagnoseSchema in
    db/migrations.h: they differ between a new and an upgraded file."""
    text, space = "", False
    for token in _TOKEN.findall(sql):
        if token[0] in " \t\n\r\f" or token.startswith(("--", "/*")):
            space = True
            continue
        if space and text and _is_word(text[-1]) and _is_word(token[0]):
            text += " "
        space = False
        text += token
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _is_word(character: str) -> bool:
    return (character.isascii() and character.isalnum()) or character in "_'\"`[]" or not character.isascii()


def _uri(path: str, mode: str) -> str:
    return f"file://{urllib.parse.quote(path)}?{mode}"


def _distinct(names: list[str]) -> list[str]:
    """Numbers repeated names, like `legopt query`: a, a_2, a_3."""
    distinct: list[str] = []
    for name in names:
        number, unique = 1, name
        while unique in distinct or (number > 1 and unique in names):
            number += 1
            unique = f"{name}_{number}"
        distinct.append(unique)
    return distinct
