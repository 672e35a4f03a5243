#!/usr/bin/env python3
"""Plays a motion in MuJoCo's viewer, by the names of joints.

    legopt export --motion json --problem 3 --out motion.json
    PYTHONPATH=python examples/players/play_mujoco.py motion.json data/NAME/robot.urdf

PYTHONPATH is needed only in the source tree, not after installation. The robot is a URDF or an MJCF file. Without a free
joint, its first body gets one."""

import sys

import motion_file
from legopt import orders


def load(mujoco, path):
    """Returns the model with a floating base."""
    spec = mujoco.MjSpec.from_file(path)
    spec.compiler.fusestatic = False  # else the base of a URDF becomes a part of the world
    base = spec.worldbody.first_body()
    if not any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in base.joints):
        base.add_freejoint()
    return spec.compile()


def player(modules, motion, arguments):
    mujoco, viewer = modules
    model = load(mujoco, arguments.robot)
    data = mujoco.MjData(model)
    positions = motion.converted(orders.mujoco(motion.joint_names, model))
    with viewer.launch_passive(model, data) as window:
        def show(k):
            data.qpos[:] = positions[k]
            data.time = motion.times_s[k]
            mujoco.mj_forward(model, data)
            window.sync()

        motion_file.play(motion, show, arguments.speed, arguments.repeat)


if __name__ == "__main__":
    sys.exit(motion_file.run(player, ["mujoco", "mujoco.viewer"], "pip install mujoco", __doc__))
