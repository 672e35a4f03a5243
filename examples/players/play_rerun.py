#!/usr/bin/env python3
"""Shows a motion in rerun, by the names of joints: the robot, its contact forces, joint velocities and torques.

    legopt export --motion json --problem 3 --out motion.json
    PYTHONPATH=python examples/players/play_rerun.py motion.json data/NAME/robot.urdf

PYTHONPATH is needed only in the source tree, not after installation. Needs rerun 0.28 or newer. Its viewer plays the
motion and has the speed, so --speed and --repeat have no effect."""

import sys

import motion_file

METRES_PER_NEWTON = 1e-3


def log_poses(rerun, joints, root, motion, k):
    """Logs the poses of all links."""
    vector = motion.vectors[k]
    x, y, z, qw, qx, qy, qz = vector[-7:]
    rerun.log("transforms", rerun.Transform3D(translation=[x, y, z], quaternion=rerun.Quaternion(xyzw=[qx, qy, qz, qw]),
                                              parent_frame="world", child_frame=root))
    for name, value in zip(motion.joint_names, vector):
        rerun.log("transforms", joints[name].compute_transform(value))


def log_loads(rerun, motion, k):
    """Logs velocities, torques and contact forces."""
    sample = motion.samples[k]
    for name, velocity, torque in zip(motion.joint_names, sample["velocities"], sample["torques"]):
        rerun.log(f"velocities/{name}", rerun.Scalars(velocity))
        rerun.log(f"torques/{name}", rerun.Scalars(torque))
    forces = [force for points in sample["contacts"].values() for force in points]
    rerun.log("forces", rerun.Arrows3D(origins=[force["at_m"] for force in forces],
                                       vectors=[[METRES_PER_NEWTON * f for f in force["force_N"]] for force in forces]))


def player(modules, motion, arguments):
    rerun, urdf = modules
    found = urdf.UrdfTree.from_file_path(arguments.robot).joints()
    joints = {joint.name: joint for joint in found}
    missing = [name for name in motion.joint_names if name not in joints]
    if missing:
        raise ValueError(f"{arguments.robot}: has no joint '{missing[0]}'; give the robot of the motion's dataset")
    children = {joint.child_link for joint in found}
    root = next(joint.parent_link for joint in found if joint.parent_link not in children)
    rerun.init("legopt motion", spawn=True)
    rerun.log_file_from_path(arguments.robot, static=True)
    for k, moment in enumerate(motion.times_s):
        rerun.set_time("time", duration=moment)
        log_poses(rerun, joints, root, motion, k)
        log_loads(rerun, motion, k)


if __name__ == "__main__":
    sys.exit(motion_file.run(player, ["rerun", "rerun.urdf"], "pip install rerun-sdk", __doc__))
