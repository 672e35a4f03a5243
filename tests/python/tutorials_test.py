"""The tutorials of docs/tutorials, command by command, each in a folder and a network namespace of its own.

A fenced block whose first line names a file, such as ```yaml mine.yaml, is that file. A ```console block has commands
and a part of their output. Policy: every command ends with code 0, and prints the shown counts of solved problems (as
in 49/50), in the shown order. Figures, which depend on the machine, are not compared."""

import contextlib
import os
import re
import signal
import subprocess
import unittest

import results

TUTORIALS = results.SOURCE / "docs" / "tutorials"
FENCE = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COUNTS = re.compile(r"\b\d+/\d+\b")
OWN_NETWORK = "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec bash -e \"$0\""
PREAMBLE = "trap 'kill $(jobs -p) 2>/dev/null || true' EXIT\n"
TIME_TO_START = "sleep 3\n"  # of a program in the background; a reader takes longer for the next command
LONGEST_S = 400


def commands(block):
    """Returns the commands of a console block with the shown output."""
    parts = re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]
    return [(part.split("\n", 1)[0], part.split("\n", 1)[1]) for part in parts]


class Tutorials(unittest.TestCase):
    def run_script(self, folder, environment):
        """Returns exit code, output and errors; ends everything that the script has started."""
        out, err = folder / "out", folder / "err"
        with out.open("w") as out_file, err.open("w") as err_file:
            process = subprocess.Popen(["unshare", "--net", "--map-root-user", "bash", "-c", OWN_NETWORK, "script"],
                                       cwd=folder, env=environment, stdout=out_file, stderr=err_file,
                                       stdin=subprocess.DEVNULL, start_new_session=True)
            try:
                process.wait(LONGEST_S)
            except subprocess.TimeoutExpired:
                self.fail(f"not over after {LONGEST_S} s:\n{out.read_text()}{err.read_text()}")
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        return process.returncode, out.read_text(), err.read_text()

    def play(self, name):
        folder = results.experiments().folder / name
        folder.mkdir()
        for link in ("data", "examples"):
            (folder / link).symlink_to(results.SOURCE / link)
        script, shown = [PREAMBLE], []
        for language, file, text in FENCE.findall((TUTORIALS / name).with_suffix(".md").read_text()):
            if file.strip():
                (folder / file.strip()).write_text(text)
            elif language == "console":
                for command, output in commands(text):
                    script.append(f"echo '$ '{len(shown)}\n{command}\n")
                    if command.endswith("&"):
                        script.append(TIME_TO_START)
                    shown.append((command, output))
        (folder / "script").write_text("".join(script))
        environment = {**results.environment(), "PATH": f"{results.build()}:{os.environ['PATH']}",
                       "PYTHONPATH": str(results.PACKAGE), "LEGOPT_DATA": str(results.SOURCE / "data")}
        outcome, out, err = self.run_script(folder, environment)
        if "unshare failed" in err:
            self.skipTest("SKIPPED, NO NETWORK NAMESPACES HERE: " + err.strip())
        self.assertEqual(outcome, 0, out + err)
        printed = re.split(r"^\$ \d+\n", out, flags=re.MULTILINE)[1:]
        self.assertEqual(len(printed), len(shown))
        for (command, wanted), got in zip(shown, printed):
            rows = [COUNTS.findall(line) for line in got.splitlines()]
            for line in wanted.splitlines():
                counts = COUNTS.findall(line)
                if counts:
                    self.assertIn(counts, [row[:len(counts)] for row in rows], f"{command}: {line}\n{got}")

    def test_first_table(self):
        self.play("first-table")

    def test_my_solver(self):
        if subprocess.run(["/usr/bin/python3", "-c", "import numpy"], capture_output=True, check=False).returncode:
            self.skipTest("SKIPPED, NO NUMPY HERE: apt install python3-numpy")
        self.play("my-solver")

    def test_a_lab_pool(self):
        self.play("lab-pool")

    def test_from_an_idea_to_a_figure(self):
        self.play("idea-to-figure")


if __name__ == "__main__":
    unittest.main()
