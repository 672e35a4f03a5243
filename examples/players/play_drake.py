#!/usr/bin/env python3
"""Plays a motion in Drake's Meshcat, by the names of joints.

    legopt export --motion json --problem 3 --out motion.json
    PYTHONPATH=python examples/players/play_drake.py motion.json data/NAME/robot.urdf

PYTHONPATH is needed only in the source tree, not after installation. Drake prints the address of the page."""

import sys

import motion_file
from legopt import orders


def player(modules, motion, arguments):
    (drake,) = modules
    builder = drake.DiagramBuilder()
    plant, scene_graph = drake.AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    drake.Parser(plant).AddModels(arguments.robot)
    plant.Finalize()
    drake.MeshcatVisualizer.AddToBuilder(builder, scene_graph, drake.StartMeshcat())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    of_plant = plant.GetMyContextFromRoot(context)
    positions = motion.converted(orders.drake(motion.joint_names, plant))

    def show(k):
        context.SetTime(motion.times_s[k])
        plant.SetPositions(of_plant, positions[k])
        diagram.ForcedPublish(context)

    motion_file.play(motion, show, arguments.speed, arguments.repeat)


if __name__ == "__main__":
    sys.exit(motion_file.run(player, ["pydrake.all"], "pip install drake", __doc__))
