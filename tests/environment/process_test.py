#!/usr/bin/env python3
"""Policy: actions of shells, other programs and other users around a program change neither its result nor the cause it
reports. process_test.py BUILD CASE"""
import os
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
import unittest

import environment_test

BUILD = os.path.abspath(sys.argv[1]) if len(sys.argv) > 1 else ""
PATIENCE_S = 120


class ProcessTest(unittest.TestCase):
    def setUp(self):
        self.bench = environment_test.Bench(BUILD)
        self.addCleanup(self.bench.remove)
        self.folder = self.bench.template

    def command(self, *arguments):
        return [os.path.join(BUILD, "legopt"), *arguments]

    def start(self, *arguments, **options):
        options = {"cwd": self.folder, "env": self.bench.environment(), "stdout": subprocess.PIPE, "stderr": subprocess.PIPE,
                   "text": True, **options}
        process = subprocess.Popen(arguments, **options)
        self.addCleanup(process.kill)
        return process

    def run_to_end(self, *arguments, **options):
        text = options.pop("text_for_input", None)
        if text is not None:
            options["stdin"] = subprocess.PIPE
        process = self.start(*arguments, **options)
        out, err = process.communicate(text, timeout=PATIENCE_S)
        return process.returncode, out, err

    def suite(self):
        with open(os.path.join(self.folder, "s.yaml"), encoding="utf-8") as file:
            return file.read()

    def test_a_suite_comes_from_anything_that_can_be_read(self):
        for name in ("-", "/dev/stdin"):
            code, out, err = self.run_to_end(*self.command("run", name, "--dry-run"), text_for_input=self.suite())
            self.assertEqual((code, "2 jobs" in out), (0, True), err)
            self.assertIn("relative to the working directory", err)
        shell = 'exec "$0" run <(cat s.yaml) --dry-run'
        code, out, err = self.run_to_end("bash", "-c", shell, *self.command())
        self.assertEqual((code, "2 jobs" in out), (0, True), err)

    def test_a_relative_dataset_of_a_piped_suite_is_found_from_here(self):
        dataset = os.path.realpath(os.path.join(BUILD, "legopt-data", "garage-small"))
        shutil.copytree(dataset, os.path.join(self.folder, "mine"))
        code, _, err = self.run_to_end(*self.command("run", "-", "--dry-run"), text_for_input=self.suite().replace(dataset, "mine"))
        self.assertEqual(code, 0, err)
        self.assertIn(os.path.join(os.path.realpath(self.folder), "mine"), err)

    def test_solutions_come_from_a_pipe(self):
        dataset = os.path.join(BUILD, "legopt-data", "garage-small")
        with open(os.path.join(self.folder, "given.json"), encoding="utf-8") as file:
            text = file.read()
        usual = self.run_to_end(*self.command("evaluate", "given.json", "--dataset", dataset))
        piped = self.run_to_end(*self.command("evaluate", "-", "--dataset", dataset), text_for_input=text)
        self.assertEqual((usual[0], usual[1].replace("given.json", "/dev/stdin")), piped[:2], piped[2])

    def test_a_solver_declaration_comes_from_a_pipe(self):
        code, _, err = self.run_to_end("bash", "-c", 'exec "$0" run s.yaml --db d.sqlite --solver <(cat solver.json)',
                                       *self.command())
        self.assertEqual(code, 0, err)
        self.assertEqual([name for name in os.listdir(self.folder) if name.startswith(".legopt")], [])

    def test_a_fault_of_a_piped_text_names_what_the_user_named(self):
        code, _, err = self.run_to_end(*self.command("run", "s.yaml", "--solver", "-"), text_for_input="{broken")
        self.assertEqual(code, 2, err)
        self.assertIn("/dev/stdin:1", err)
        code, _, err = self.run_to_end(*self.command("run", "-", "--solver", "/dev/stdin"), text_for_input=self.suite())
        self.assertEqual(code, 2, err)
        self.assertIn("standard input (-) is named 2 times", err)

    def test_damaged_json_of_a_file_is_damage_and_in_a_query_a_mistake(self):
        database = sqlite3.connect(os.path.join(self.folder, "small.sqlite"))
        database.executescript("PRAGMA ignore_check_constraints = 1; UPDATE experiments SET spec_json = '{broken';")
        database.close()
        code, _, err = self.run_to_end(*self.command("table", "1", "--db", "small.sqlite"))
        self.assertEqual(code, 6, err)
        self.assertIn("legopt service restore", err)
        code, _, err = self.run_to_end(*self.command("query", "SELECT json('x')", "--db", "small.sqlite"))
        self.assertEqual(code, 2, err)

    def test_texts_of_the_command_line_are_utf8_and_names_tell_apart(self):
        worker = [os.path.join(BUILD, "legopt-worker"), "--slots", "1", "--idle-timeout", "1", "--name"]
        for command, cause in ((self.command("query", b"SELECT 'm\xfc'", "--db", "small.sqlite"), "UTF-8"), ([*worker, b"m\xfc"], "UTF-8"),
                               ([*worker, "a "], "blank"), ([*worker, "a\u202eb"], "U\\+202E")):
            code, _, err = self.run_to_end(*command)
            self.assertEqual(code, 2, err)
            self.assertRegex(err, cause)

    def test_runs_that_begin_together_have_files_of_their_own(self):
        runs = [self.start(*self.command("run", "s.yaml", "--workers", "1")) for _ in range(4)]
        for run in runs:
            _, err = run.communicate(timeout=PATIENCE_S)
            self.assertEqual(run.returncode, 0, err)
        files = [name for name in os.listdir(self.folder) if name.startswith("s-") and name.endswith(".sqlite")]
        self.assertEqual(len(files), 4, files)

    def test_a_run_that_could_not_begin_leaves_no_file(self):
        before = set(os.listdir(self.folder))
        code, _, _ = self.run_to_end("unshare", "-n", *self.command("run", "s.yaml"))
        self.assertEqual(code, 7)
        self.assertEqual(set(os.listdir(self.folder)), before)

    def test_nohup_is_obeyed(self):
        run = self.start(*self.command("run", "s.yaml", "--db", "n.sqlite"),
                         preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
        while run.poll() is None:
            run.send_signal(signal.SIGHUP)
            time.sleep(0.05)
        self.assertEqual(run.returncode, 0, run.stderr.read())

    def test_a_signal_is_the_cause_of_a_death_and_a_warning_is_none(self):
        folder = os.path.join(self.folder, "programs")
        os.mkdir(folder)
        shutil.copy(os.path.join(BUILD, "legopt"), folder)
        os.symlink(os.path.join(BUILD, "legopt-data"), os.path.join(folder, "legopt-data"))
        server = os.path.join(folder, "legopt-server")
        with open(server, "w", encoding="utf-8") as file:
            file.write("#!/bin/sh\necho '[2026] [legopt-server] [warning] no key' >&2\nkill -XFSZ $$\n")
        os.chmod(server, 0o755)
        code, _, err = self.run_to_end(os.path.join(folder, "legopt"), "run", "s.yaml", "--db", "e.sqlite")
        self.assertEqual(code, 70)
        self.assertIn("SIGXFSZ", err)
        self.assertNotIn("no key", err)

    def test_a_signal_from_outside_is_no_defect(self):
        folder = os.path.join(self.folder, "programs-of-signals")
        os.mkdir(folder)
        shutil.copy(os.path.join(BUILD, "legopt"), folder)
        os.symlink(os.path.join(BUILD, "legopt-data"), os.path.join(folder, "legopt-data"))
        server = os.path.join(folder, "legopt-server")
        for name, expected in (("KILL", 71), ("XCPU", 71), ("TERM", 8), ("HUP", 8), ("SEGV", 70)):
            with self.subTest(name):
                with open(server, "w", encoding="utf-8") as file:
                    file.write(f"#!/bin/sh\necho '[2026] [legopt-server] [warning] [legopt-server] [error] quoted' >&2\nkill -{name} $$\n")
                os.chmod(server, 0o755)
                code, _, err = self.run_to_end(os.path.join(folder, "legopt"), "run", "s.yaml", "--db", "o.sqlite")
                self.assertEqual(code, expected, err)
                self.assertIn("SIG" + name, err)
                self.assertNotIn("quoted", err)

    def test_a_signal_that_ends_ssh_is_the_cause(self):
        self.assertEqual(self.run_to_end(*self.command("service", "keygen", "lab.key"))[0], 0)
        server = self.start(os.path.join(BUILD, "legopt-server"), "--db", "lab.sqlite", "--listen", "127.0.0.1:7801", "--access",
                            "lab.access", "--key-file", "lab.key", stdout=subprocess.PIPE)
        server.stdout.readline()
        os.mkdir(os.path.join(self.folder, "bin"))
        with open(os.path.join(self.folder, "pool.yaml"), "w", encoding="utf-8") as file:
            file.write("ssh: {hosts: [one]}\n")
        ssh = os.path.join(self.folder, "bin", "ssh")
        try:
            for end, meaning in (("kill -SEGV $$", "ssh ended with signal 11, SIGSEGV"), ("exit 137", "a shell reports SIGKILL")):
                with open(ssh, "w", encoding="utf-8") as file:
                    file.write(f"#!/bin/sh\n{end}\n")
                os.chmod(ssh, 0o755)
                code, _, err = self.run_to_end("env", f"PATH={os.path.dirname(ssh)}:{os.environ['PATH']}", *self.command(
                    "pool", "ssh", "pool.yaml", "--access", "lab.access", "--key-file", "lab.key", "--folder", "lab"))
                self.assertEqual(code, 14, err)
                self.assertIn(meaning, err)
        finally:
            server.terminate()
            server.communicate(timeout=environment_test.END_S)

    def test_closed_standard_output_is_not_a_full_disk(self):
        code, _, err = self.run_to_end("sh", "-c", f"exec {os.path.join(BUILD, 'legopt')} --version >&-")
        self.assertEqual(code, 2)
        self.assertIn("it is closed", err)
        self.assertNotIn("disk", err)

    def test_slots_are_reduced_to_what_descriptors_allow(self):
        limit = 64
        worker = self.start(os.path.join(BUILD, "legopt-worker"), "--slots", "60", stdout=subprocess.PIPE,
                            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (limit, limit)))
        first = worker.stdout.readline()
        self.assertRegex(first, r"^legopt-worker: [1-9] slots?: 60 slots would be too many: .*ulimit -n")
        worker.terminate()
        self.assertEqual(worker.wait(environment_test.END_S), 0, worker.stderr.read())

    def test_two_tasks_are_not_written_into_one_stream(self):
        with open(os.path.join(self.folder, "two.yaml"), "w", encoding="utf-8") as file:
            file.write(self.suite().replace("[posture]", "[{task: posture, problems: [0]}, {task: motion, problems: [0]}]")
                       .replace('problems: "0-1"\n', ""))
        dataset = os.path.join(BUILD, "legopt-data", "garage-small")
        code, _, err = self.run_to_end(*self.command("run", "two.yaml", "--db", "two.sqlite"))
        self.assertIn(code, (0, 4), err)
        for out in ("/dev/stdout", "/dev/fd/1", "-"):
            code, _, err = self.run_to_end(*self.command("export", "1", "--db", "two.sqlite", "--dataset", dataset, "--out", out))
            self.assertEqual(code, 2, err)
            self.assertIn("--task", err)
        self.assertFalse(os.path.exists("/dev/stdout-posture"))

    def test_planted_links_are_not_written_through(self):
        dataset = os.path.join(BUILD, "legopt-data", "garage-small")
        precious = os.path.join(self.folder, "precious")
        attempts = {
            "r.sqlite.lock": [os.path.join(BUILD, "legopt-server"), "--db", "r.sqlite"],
            "report.html.new": self.command("report", "1", "--db", "small.sqlite", "--dataset", dataset, "--out", "report.html"),
            "s.json.new": self.command("export", "1", "--db", "small.sqlite", "--dataset", dataset, "--out", "s.json"),
            "copy.sqlite": self.command("service", "backup", "--db", "small.sqlite", "copy.sqlite"),
            "k.key": self.command("service", "keygen", "k.key"),
        }
        for link, command in attempts.items():
            with self.subTest(link):
                with open(precious, "w", encoding="utf-8") as file:
                    file.write("secrets")
                os.symlink(precious, os.path.join(self.folder, link))
                process = self.start(*command)
                try:
                    process.communicate(timeout=10 if "legopt-server" in command[0] else PATIENCE_S)
                except subprocess.TimeoutExpired:
                    process.terminate()
                    process.wait(environment_test.END_S)
                with open(precious, encoding="utf-8") as file:
                    self.assertEqual(file.read(), "secrets")
                os.remove(os.path.join(self.folder, link))


if __name__ == "__main__":
    if not environment_test.in_own_network():
        print("SKIPPED: no network namespaces here (root is needed)")
        sys.exit(environment_test.SKIPPED)
    unittest.main(argv=[sys.argv[0], "-v"] + [f"ProcessTest.{case}" for case in sys.argv[2:]])
