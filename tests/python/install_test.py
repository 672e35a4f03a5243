"""The package as users get it: by pip without a network, by the build's install, at the version of legopt."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

import results

import legopt


class Scratch(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="legopt-python-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def run_command(self, *command, **changes):
        environment = {name: value for name, value in results.environment().items() if name != "PYTHONPATH"}
        done = subprocess.run([str(word) for word in command], env=environment | changes, text=True, capture_output=True,
                              stdin=subprocess.DEVNULL, check=False, cwd=self.folder)
        self.assertEqual(done.returncode, 0, f"{command}: {done.stdout}{done.stderr}")
        return done.stdout

    def check_installed(self, folder):
        """Checks that the installed package is complete and reads a database."""
        ours = {path.name for path in (results.PACKAGE / "legopt").iterdir() if path.suffix in (".py", ".typed")}
        self.assertEqual({path.name for path in (folder / "legopt").iterdir() if path.name != "__pycache__"}, ours)
        said = self.run_command(sys.executable, "-B", "-c", "import legopt, sys; print(legopt.__file__); "
                                "print(len(legopt.open(sys.argv[1]).experiments()))", results.experiments().backup,
                                PYTHONPATH=str(folder))
        self.assertEqual(said.split(), [str(folder / "legopt" / "__init__.py"), "2"])


class Pip(Scratch):
    def test_it_installs_without_a_network(self):
        for package in ("pip", "setuptools", "wheel"):
            if importlib.util.find_spec(package) is None:
                raise unittest.SkipTest(f"NO {package.upper()} HERE: apt install python3-pip")
        source = self.folder / "source"  # setuptools leaves build/ and *.egg-info in the source tree
        shutil.copytree(results.PACKAGE, source, ignore=shutil.ignore_patterns("__pycache__"))
        self.run_command(sys.executable, "-m", "pip", "install", "--no-index", "--no-build-isolation", "--no-deps", "--target",
                         self.folder / "target", source, PIP_NO_INDEX="1", PIP_CONFIG_FILE=os.devnull,
                         PIP_DISABLE_PIP_VERSION_CHECK="1", HOME=str(self.folder))
        self.check_installed(self.folder / "target")


class Build(Scratch):
    def test_the_install_rule_has_every_file(self):
        if not (results.build() / "CMakeCache.txt").exists():
            raise unittest.SkipTest("NO BUILD FOLDER OF CMAKE HERE")
        self.run_command("cmake", "--install", results.build(), "--component", "programs", "--prefix", "/usr",
                         DESTDIR=str(self.folder / "image"))
        self.check_installed(self.folder / "image" / "usr" / "lib" / "python3" / "dist-packages")
        image = self.folder / "image" / "usr"
        self.assertEqual(list(image.rglob("*.pyc")), [])
        # It finds the program installed with it.
        said = self.run_command(sys.executable, "-B", "-c", "import legopt, sys; "
                                "print(legopt.open(sys.argv[1]).run('table', 1, '--format', 'csv'))",
                                results.experiments().backup, PATH=f"{image}/bin:{os.environ['PATH']}", LEGOPT="",
                                PYTHONPATH=str(image / "lib" / "python3" / "dist-packages"))
        self.assertTrue(said.startswith("experiment_id,"))


class Versions(unittest.TestCase):
    def test_there_is_one(self):
        project = tomllib.loads((results.PACKAGE / "pyproject.toml").read_text())["project"]
        (cmake,) = re.findall(r"^project\(legopt VERSION ([\d.]+)", (results.SOURCE / "CMakeLists.txt").read_text(), re.M)
        self.assertEqual((project["version"], legopt.__version__), (cmake, cmake))

    def test_it_needs_nothing_but_python(self):
        project = tomllib.loads((results.PACKAGE / "pyproject.toml").read_text())["project"]
        self.assertNotIn("dependencies", project)
        said = subprocess.run([sys.executable, "-S", "-B", "-c", "import sys; sys.path.insert(0, sys.argv[1]); import legopt; "
                               "print(len(legopt.open(sys.argv[2]).jobs()))", str(results.PACKAGE),
                               str(results.experiments().backup)], capture_output=True, text=True, check=True)
        self.assertGreater(int(said.stdout), 0)
