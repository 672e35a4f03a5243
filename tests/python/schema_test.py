"""The package trusts a database only if its schema's text is that of a release.

schema_test.py DATABASE: prints python/legopt/schema_digests.py, from a new database of this release."""

import shutil
import sqlite3
import sys
import tempfile
import unittest
from pathlib import Path

import results

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python"))

import legopt
from legopt import read_only_file
from legopt.schema_digests import SCHEMA_DIGESTS, SCHEMA_VERSION

HEAD = '''"""Version of the schema, and digest of the text of each entry: made by tests/python/schema_test.py, checked by it."""

SCHEMA_VERSION = {version}
SCHEMA_DIGESTS = {{
'''


def digests_of(path):
    with sqlite3.connect(f"file://{path}?mode=ro&immutable=1", uri=True) as connection:
        rows = connection.execute("SELECT type || ' ' || name, sql FROM sqlite_schema WHERE sql IS NOT NULL ORDER BY 1")
        return {entry: read_only_file.digest_of(sql) for entry, sql in rows}


def version_of(path):
    with sqlite3.connect(f"file://{path}?mode=ro&immutable=1", uri=True) as connection:
        return connection.execute("PRAGMA user_version").fetchone()[0]


class TheSchema(unittest.TestCase):
    def test_version_and_digests_are_those_of_the_release(self):
        advice = "write python/legopt/schema_digests.py anew: see tests/python/schema_test.py"
        self.assertEqual(SCHEMA_VERSION, version_of(results.experiments().backup), advice)
        self.assertEqual(SCHEMA_DIGESTS, digests_of(results.experiments().backup), advice)

    def changed(self, sql):
        path = results.experiments().copy()
        with sqlite3.connect(path) as connection:
            connection.executescript(sql)
        connection.close()
        return path

    def test_what_says_something_else_is_refused_by_name(self):
        for sql, words in [
                ("CREATE TRIGGER t AFTER INSERT ON experiment_tags BEGIN SELECT 1; END", "trigger 't' on table"),
                ("DROP VIEW benchmark_table; CREATE VIEW benchmark_table AS SELECT 1 AS solved",
                 "view 'benchmark_table' is not that of schema version"),
                ("DROP VIEW job_list", "view job_list is missing; start 'legopt-server --db"),
                ("CREATE UNIQUE INDEX i ON events (event_id, kind)", "index 'i' on table 'events'")]:
            with self.subTest(sql), self.assertRaisesRegex(legopt.DatabaseError, words):
                legopt.open(self.changed(sql))

    def test_what_a_user_adds_is_let_be(self):
        with legopt.open(self.changed("CREATE TABLE mine (x); CREATE VIEW v AS SELECT * FROM mine; "
                                      "CREATE INDEX i ON results (cost); ANALYZE")) as db:
            self.assertTrue(db.experiments())

    def test_an_endless_query_is_stopped(self):
        with legopt.Database(results.experiments().backup, limit_s=0.2) as db:
            with self.assertRaisesRegex(legopt.DatabaseError, "stopped after 0.2 s"):
                db.query("WITH RECURSIVE r(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM r) SELECT count(*) FROM r")
            self.assertEqual(len(db.query("SELECT 1 AS x")), 1)


class ALog(unittest.TestCase):
    """A log with a file it was not written for."""

    def test_is_refused(self):
        path = results.experiments().copy()
        former = path.read_bytes()
        writer = sqlite3.connect(path)
        writer.execute("PRAGMA journal_mode = WAL")
        writer.execute("UPDATE file_state SET session = '0123456789abcdef0123456789abcdef'")
        writer.commit()
        with tempfile.TemporaryDirectory() as folder:
            kept = Path(folder) / "log"
            shutil.copyfile(f"{path}-wal", kept)
            writer.close()
            path.write_bytes(former)
            Path(f"{path}-shm").unlink(missing_ok=True)
            shutil.copyfile(kept, f"{path}-wal")
        with self.assertRaisesRegex(legopt.DatabaseError, "was written for another file.*legopt service restore"):
            legopt.open(path)


if __name__ == "__main__":
    rows = [f'    "{entry}": "{digest}",\n' for entry, digest in digests_of(sys.argv[1]).items()]
    print(HEAD.format(version=version_of(sys.argv[1])) + "".join(rows) + "}")
