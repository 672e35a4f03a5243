#!/usr/bin/env python3
"""Plays a motion with Pinocchio in Meshcat, by the names of joints.

    legopt export --motion json --problem 3 --out motion.json
    PYTHONPATH=python examples/players/play_pinocchio.py motion.json data/NAME/robot.urdf

PYTHONPATH is needed only in the source tree, not after installation."""

import os
import sys

import motion_file
from legopt import orders


def player(modules, motion, arguments):
    pinocchio, visualize, numpy, _ = modules
    folder = os.path.dirname(os.path.abspath(arguments.robot))
    robot = pinocchio.RobotWrapper.BuildFromURDF(arguments.robot, [folder], pinocchio.JointModelFreeFlyer())
    positions = motion.converted(orders.pinocchio(motion.joint_names, robot.model))
    viewer = visualize.MeshcatVisualizer(robot.model, robot.collision_model, robot.visual_model)
    viewer.initViewer(open=True)
    viewer.loadViewerModel()
    motion_file.play(motion, lambda k: viewer.display(numpy.array(positions[k])), arguments.speed, arguments.repeat)


if __name__ == "__main__":
    sys.exit(motion_file.run(player, ["pinocchio", "pinocchio.visualize", "numpy", "meshcat"],
                             "pip install pin meshcat", __doc__))
