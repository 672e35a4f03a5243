#!/usr/bin/env python3
"""Pages of an older build say so: results_test.py BUILD_FOLDER."""
import os
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = sys.argv[1]


def check(folder, *options):
    run = subprocess.run([os.path.join(ROOT, "scripts", "check-results"), BUILD, "--results", folder, *options],
                         capture_output=True, text=True)
    if run.returncode == 77:
        print(run.stderr)
        sys.exit(77)
    return run.returncode, run.stdout


def main():
    worker = subprocess.run([os.path.join(BUILD, "legopt-worker"), "--version", "--verbose"], check=True, capture_output=True,
                            text=True)
    own = worker.stdout.split()[1]
    with tempfile.TemporaryDirectory() as folder:
        page = os.path.join(folder, "page.md")

        def write(build):
            with open(page, "w", encoding="utf-8") as file:
                file.write(f"# Title\n\nText.\n\nBuild {build} (legopt).\n")

        def read():
            with open(page, encoding="utf-8") as file:
                return file.read()

        write(own)
        assert check(folder) == (0, ""), "a page of this build needs no mark"
        write("0123456789ab")
        code, said = check(folder)
        assert code == 1 and "names builds 0123456789ab" in said, said
        assert check(folder, "--mark")[0] == 0
        assert read().startswith("# Title\n\n*Of an older build (0123456789ab): "), read()
        assert check(folder) == (0, "")
        with open(page, encoding="utf-8") as file:
            text = file.read().replace("Build 0123456789ab", f"Build {own}")
        with open(page, "w", encoding="utf-8") as file:
            file.write(text)
        assert check(folder)[0] == 1, "a page that was made again has no mark"
        check(folder, "--mark")
        assert "older build" not in read()


main()
