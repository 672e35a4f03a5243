"""run.py BUILD MODULE: runs the tests of one module of this folder with the programs of a build folder. Exits with 77
if all of them were skipped."""

import sys
import unittest
from pathlib import Path

import results

SKIPPED = 77
OLDEST = (3, 11)


def main():
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    if sys.version_info < OLDEST:
        print("SKIPPED, NO PYTHON 3.11 HERE", file=sys.stderr)
        return SKIPPED
    results.use_build(sys.argv[1])
    sys.path.insert(0, str(Path(__file__).parent))
    suite = unittest.defaultTestLoader.loadTestsFromName(sys.argv[2])
    outcome = unittest.TextTestRunner(verbosity=2).run(suite)
    for _, reason in outcome.skipped:
        print(f"SKIPPED, {reason}", file=sys.stderr)
    if not outcome.wasSuccessful() or outcome.testsRun == 0 and not outcome.skipped:
        return 1
    return SKIPPED if len(outcome.skipped) >= max(outcome.testsRun, 1) else 0


if __name__ == "__main__":
    sys.exit(main())
