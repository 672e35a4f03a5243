"""Opening: nothing is written, and a file that cannot be opened is reported with a remedy."""

import os
import sqlite3
import sys
import threading
import unittest
from pathlib import Path
from unittest import mock

import results

import legopt
from legopt import read_only_file, zstd


class NothingIsWritten(unittest.TestCase):
    def use(self, db):
        db.experiments()
        db.jobs()
        db.waypoints(1)
        db.trace(1)
        db.paired("LegOpt-best", "SQP:multi_starts=10", 1)

    def test_no_byte_changes_and_nothing_appears(self):
        path = results.experiments().copy()
        before = results.content(path.parent)
        with legopt.open(path) as db:
            self.use(db)
            self.assertEqual(results.content(path.parent), before)
        self.assertEqual(results.content(path.parent), before)

    def test_a_file_with_side_files_stays_as_it_is(self):
        path = results.experiments().copy()
        writer = sqlite3.connect(path)
        writer.execute("PRAGMA journal_mode = WAL")
        writer.execute("UPDATE experiments SET name = 'written' WHERE experiment_id = 1")
        writer.commit()
        names = {"copy.sqlite", "copy.sqlite-wal", "copy.sqlite-shm"}
        data = {name: content for name, content in results.content(path.parent).items() if not name.endswith("-shm")}
        with legopt.open(path) as db:
            self.assertEqual(db.experiments()[0]["name"], "written")
            self.use(db)
        self.assertEqual(set(results.content(path.parent)), names)
        self.assertEqual({name: results.content(path.parent)[name] for name in data}, data)
        writer.close()

    def test_a_folder_that_cannot_be_written(self):
        path = results.experiments().copy()
        path.chmod(0o444)
        path.parent.chmod(0o555)
        self.addCleanup(path.parent.chmod, 0o755)
        with legopt.open(path) as db:
            self.use(db)

    def test_only_select_is_possible(self):
        path = results.experiments().copy()
        before = results.content(path.parent)
        with legopt.open(path) as db:
            for sql in ("DELETE FROM jobs", "UPDATE experiments SET name = 'x'", "CREATE TABLE t (x)",
                        "CREATE TEMP TABLE t (x)", f"ATTACH '{path.parent}/other.sqlite' AS other", "VACUUM", "BEGIN",
                        f"VACUUM INTO '{path.parent}/other.sqlite'", "PRAGMA user_version = 3", "PRAGMA query_only = 0",
                        "SELECT load_extension('x')"):
                with self.assertRaisesRegex(legopt.RequestError, "only SELECT is allowed|load_extension", msg=sql):
                    db.query(sql)
        self.assertEqual(results.content(path.parent), before)

    def test_paths_are_taken_as_they_are(self):
        odd = results.experiments().copy("what? 100% #1 & 'so' ü.sqlite")
        link = odd.parent / "link.sqlite"
        link.symlink_to(odd.name)
        for path in (odd, str(odd), link):
            with legopt.open(path) as db:
                self.assertEqual(len(db.experiments()), 2)
        self.assertEqual({path.name for path in odd.parent.iterdir()}, {odd.name, link.name})


class WhileAServerWorks(unittest.TestCase):
    def test_a_server_that_starts_later_is_seen(self):
        made = results.experiments()
        path = made.copy()
        suite = made.suite({**results.SECOND, "name": "third", "seed": 7})
        with legopt.open(path) as db:
            self.assertEqual(len(db.experiments()), 2)
            with results.serving(path) as call:
                call("submit", suite, "--dataset", made.dataset)
                self.assertEqual([row["name"] for row in db.experiments()], ["first", "second", "third"])
                jobs = db.jobs("third")
                self.assertEqual({job["state"] for job in jobs}, {"queued"})
                self.assertEqual({job["solved"] for job in jobs}, {None})
                self.assertEqual({job["solve_ms"] for job in jobs}, {None})
                pairs = db.paired("SQP:multi_starts=0", "SQP:multi_starts=10", "third")
                self.assertEqual({pair["outcome"] for pair in pairs}, {"missing"})
                with self.assertRaisesRegex(legopt.RequestError, "is queued and has no result; 'legopt show"):
                    db.trace(jobs[0]["job_id"])
                call("cancel", 3)
                self.assertEqual({job["state"] for job in db.jobs("third")}, {"cancelled"})
                self.assertEqual({job["solved"] for job in db.jobs("third")}, {None})
            self.assertEqual({job["state"] for job in db.jobs("third")}, {"cancelled"})

    def test_a_write_during_a_statement_runs_it_again(self):
        path = results.experiments().copy()
        with legopt.open(path) as db:
            read = read_only_file.ReadOnlyFile._fetch
            runs = []

            def fetch(file, sql, parameters):
                rows = read(file, sql, parameters)
                if not runs:  # another process writes and finishes in the meantime
                    writer = sqlite3.connect(path)
                    writer.execute("UPDATE experiments SET name = 'new' WHERE experiment_id = 1")
                    writer.commit()
                    writer.close()
                runs.append(sql)
                return rows

            with mock.patch.object(read_only_file.ReadOnlyFile, "_fetch", fetch):
                self.assertEqual(db.experiments()[0]["name"], "new")
            self.assertEqual(len(runs), 2)

    def test_a_file_that_goes_away_is_told(self):
        path = results.experiments().copy()
        with legopt.open(path) as db:
            path.unlink()
            with self.assertRaisesRegex(legopt.DatabaseError, "cannot be read any more.*open it again"):
                db.experiments()


class WhatCannotBeOpened(unittest.TestCase):
    def refused(self, path, text):
        folder = Path(path).parent
        before = results.content(folder) if folder.name.startswith("tmp") else None
        with self.assertRaisesRegex(legopt.DatabaseError, text) as caught:
            legopt.open(path)
        self.assertIn(str(path), str(caught.exception))
        self.assertIsInstance(caught.exception, legopt.LegoptError)
        if before is not None:
            self.assertEqual(results.content(folder), before)

    def with_pragma(self, pragma):
        path = results.experiments().copy()
        db = sqlite3.connect(path)
        db.execute(f"PRAGMA {pragma}")
        db.execute("PRAGMA journal_mode = DELETE")
        db.close()
        return path

    def test_what_is_not_there(self):
        folder = results.experiments().copy().parent
        self.refused(folder / "none.sqlite", "no such database; check the path")
        self.refused(folder, "not a file; name the database file")

    def test_what_is_no_database_of_legopt(self):
        folder = results.experiments().copy().parent
        for content, text in ((b"no database\n" * 100, "not a SQLite file|file is not a database.*choose another file"),
                              (b"", "empty, not a legopt database")):
            path = folder / "other.sqlite"
            path.write_bytes(content)
            self.refused(path, text)
        sqlite3.connect(folder / "cars.sqlite").execute("CREATE TABLE cars (x)").connection.close()
        self.refused(folder / "cars.sqlite", "the database of another program .application_id 0.; choose another file")

    def test_other_versions(self):
        self.refused(self.with_pragma("user_version = 9"),
                     "an older legopt .schema 9.; start 'legopt-server --db .*' once, it upgrades")
        self.refused(self.with_pragma("user_version = 8"),
                     "an old legopt .schema 8, the server upgrades schema 9 and newer.; upgrade it first")
        self.refused(self.with_pragma("user_version = 9999"), "a newer legopt .schema 9999, this package knows")

    def test_the_oldest_version_is_that_of_the_first_upgrade(self):
        upgrades = [int(path.stem.rpartition("_")[2])
                    for path in (results.SOURCE / "db" / "schema").glob("upgrade_from_*.sql")]
        self.assertEqual(read_only_file._OLDEST_UPGRADABLE, min(upgrades))

    def test_what_is_damaged(self):
        path = results.experiments().copy()
        db = sqlite3.connect(path)
        db.execute("DROP VIEW job_list")
        db.close()
        with self.assertRaisesRegex(legopt.DatabaseError, "view job_list is missing; start .legopt-server --db"):
            legopt.open(path)
        path = results.experiments().copy()
        with open(path, "r+b") as file:
            file.seek(8192)
            file.write(os.urandom(path.stat().st_size - 8192))
        with self.assertRaisesRegex(legopt.DatabaseError, "malformed.*restore a backup"):
            with legopt.open(path) as db:
                db.jobs()

    def test_an_old_sqlite(self):
        with mock.patch.object(read_only_file.sqlite3, "sqlite_version_info", (3, 31, 1)):
            with self.assertRaisesRegex(legopt.DatabaseError, "3.37 or newer"):
                legopt.open(results.experiments().backup)

    def test_what_is_closed(self):
        db = legopt.open(results.experiments().backup)
        db.close()
        db.close()
        with self.assertRaisesRegex(legopt.DatabaseError, "closed; open it again"):
            db.jobs()
        self.assertIn("backup.sqlite", repr(db))


class WrongRequests(unittest.TestCase):
    def test_each_names_the_thing_and_what_there_is(self):
        wrong = [(lambda db: db.jobs(9), "no experiment '9'; valid: 2, 1"),
                 (lambda db: db.jobs("frist"), "no experiment 'frist'"),
                 (lambda db: db.jobs(1, rule="strickt"), "'strickt' is no rule; did you mean 'strict'.*literal"),
                 (lambda db: db.waypoints(10_000), "job 10000 does not exist; jobs.. has those that do"),
                 (lambda db: db.trace(0), "job 0 does not exist"),
                 (lambda db: db.query("SELECT * FROM job_lst"), "bad SQL: no such table: job_lst; tables and views: .*job_list"),
                 (lambda db: db.query("SELEC 1"), "bad SQL"),
                 (lambda db: db.query("SELECT 1; SELECT 2"), "one statement"),
                 (lambda db: db.query("SELECT ?"), "bad SQL"),
                 (lambda db: db.query(""), "empty SQL"),
                 (lambda db: db.jobs(1).column("coost"), "no column 'coost'; did you mean 'cost'"),
                 (lambda db: db.jobs(1).where(stat="done"), "no column 'stat'")]
        with legopt.open(results.experiments().backup) as db:
            for ask, text in wrong:
                with self.assertRaisesRegex(legopt.RequestError, text) as caught:
                    ask(db)
                self.assertIsInstance(caught.exception, ValueError)
            self.assertEqual(len(db.jobs("1")), len(db.jobs("first")))

    def test_one_thread(self):
        with legopt.open(results.experiments().backup) as db:
            faults = []

            def use():
                try:
                    db.jobs()
                except legopt.LegoptError as error:
                    faults.append(error)

            thread = threading.Thread(target=use)
            thread.start()
            thread.join()
            self.assertRegex(str(faults[0]), "thread")


class MissingPackages(unittest.TestCase):
    def test_what_needs_them_names_debians(self):
        with legopt.open(results.experiments().backup) as db, mock.patch.dict(sys.modules, {"numpy": None, "pandas": None}):
            self.assertEqual(len(db.experiments()), 2)
            for ask, package in ((db.jobs().frame, "pandas"), (db.waypoints(1).array, "numpy"),
                                 (db.waypoints(1).frame, "pandas")):
                with self.assertRaisesRegex(legopt.MissingPackageError, f"apt install python3-{package}") as caught:
                    ask()
                self.assertIsInstance(caught.exception, ImportError)

    def test_traces_need_a_decompressor(self):
        with legopt.open(results.experiments().backup) as db, mock.patch.dict(sys.modules, {"zstandard": None}), \
                mock.patch.object(zstd, "_of_python", lambda: None), mock.patch.object(zstd, "_load", lambda name: None):
            zstd._decompressor.cache_clear()
            self.addCleanup(zstd._decompressor.cache_clear)
            with self.assertRaisesRegex(legopt.MissingPackageError, "apt install libzstd1, elsewhere: pip install zstandard"):
                db.trace(1)
            self.assertEqual(len(db.waypoints(1)), 1)

    def test_every_decompressor_that_is_here_says_the_same(self):
        (packed,) = sqlite3.connect(results.experiments().backup).execute("SELECT trace FROM results WHERE job_id = 1").fetchone()
        length = int.from_bytes(packed[:4], "little")
        part = packed[4:4 + length]
        makers = [make for make in (zstd._of_python(), zstd._of_package(), zstd._of_system()) if make]
        self.assertEqual(len({make(part, 1 << 20) for make in makers}), 1)
        for make in makers:
            for damaged in (b"", b"no frame", part[:-5], part[:5]):
                with self.assertRaises(ValueError):
                    make(damaged, 1 << 20)
            with self.assertRaises(ValueError):
                make(part, 10)
