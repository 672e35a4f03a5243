"""Motions that `legopt export --motion json` wrote, for the players of this folder."""

import argparse
import dataclasses
import importlib
import json
import sys
import time

import legopt

FORMAT = 1
MISSING_PACKAGE = 3  # exit code


@dataclasses.dataclass(frozen=True)
class Motion:
    """A motion, sampled in time. A vector is legopt's: joints in the order of `joint_names`, base x y z, base quaternion
    w x y z."""

    joint_names: list  #: followers (mimic joints) last
    times_s: list
    vectors: list
    samples: list  #: as in the file: velocities, torques, contacts
    num_dofs: int  #: joints that are no followers

    @property
    def duration_s(self):
        return self.times_s[-1]

    def converted(self, order):
        """Returns the vectors in the order of another library (legopt.orders)."""
        return order.from_legopt(self.vectors)


def read(path):
    """Reads a file. ValueError with file, fault and fix."""
    fix = "write it with: legopt export --motion json --out FILE"
    try:
        with open(path, encoding="utf-8") as stream:
            text = json.load(stream)
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: cannot be read as JSON ({error}); {fix}") from error
    if not isinstance(text, dict) or text.get("kind") != "motion":
        raise ValueError(f"{path}: is no motion; {fix}")
    if text["format"] > FORMAT:
        raise ValueError(f"{path}: has format {text['format']}, known is {FORMAT}; use the players of that release")
    names, followers, samples = text["joints"], text["followers"], text["samples"]
    vectors = []
    for sample in samples:
        joints = dict(zip(names, sample["positions"]))
        for follower in followers:  # a leader is before its followers
            joints[follower["joint"]] = follower["multiplier"] * joints[follower["leader"]] + follower["offset"]
        vectors.append([*joints.values(), *sample["base_position_m"], *sample["base_quaternion_wxyz"]])
    return Motion([*names, *(follower["joint"] for follower in followers)], [sample["time_s"] for sample in samples],
                  vectors, samples, len(names))


def play(motion, show, speed, repeat):
    """Calls show(k) with the number of the sample of the present time, until the end or Ctrl-C."""
    try:
        while True:
            begin = time.monotonic()
            for k, moment in enumerate(motion.times_s):
                wait = moment / speed - (time.monotonic() - begin)
                if wait > 0:
                    time.sleep(wait)
                show(k)
            if not repeat:
                return
    except KeyboardInterrupt:
        pass


def run(player, package, install, description):
    """Main function of a player: reads the arguments and the motion, then calls player(modules, motion, arguments).
    `package`: modules to import; `install`: command that installs them."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("motion", help="file of legopt export --motion json")
    parser.add_argument("robot", help="robot description, e.g. the dataset's robot.urdf")
    parser.add_argument("--speed", type=float, default=1.0, help="1 (default): real time")
    parser.add_argument("--repeat", action="store_true", help="play until Ctrl-C")
    arguments = parser.parse_args()
    name = parser.prog.removesuffix(".py")
    try:
        motion = read(arguments.motion)
        print(f"{arguments.motion}: {motion.num_dofs} joints, {len(motion.times_s)} samples, {motion.duration_s:.2f} s")
        player([importlib.import_module(module) for module in package], motion, arguments)
    except ImportError as error:
        print(f"{name}: needs the Python package {package[0].split('.')[0]} ({error}); install it: {install}",
              file=sys.stderr)
        return MISSING_PACKAGE
    except (ValueError, legopt.LegoptError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    return 0
