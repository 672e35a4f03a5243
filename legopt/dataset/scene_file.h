#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "legopt/geometry/scene.h"

namespace legopt {

/// Reads a scene: a `.yaml` file of objects, or one mesh file (.stl .obj .dae .ply .gltf .glb .off), which becomes
/// one object.
///
///     objects:                                # required; all lengths in metres, angles in radians, world frame
///       - {name: slab-0, shape: box, size: [10, 8, 0.2], position: [0, 0, -0.1], rpy: [0, 0.05, 0]}
///       - {name: column, shape: cylinder, radius: 0.3, length: 3, position: [2, 0, 1.5]}   # axis z, centred
///       - {name: ball, shape: sphere, radius: 0.1}
///       - {name: rail, shape: capsule, radius: 0.05, length: 2}         # length without the caps
///       - {name: car, shape: mesh, file: meshes/car.stl, scale: 1}      # scale: a number or [x, y, z]
///       - {name: floor, shape: plane, normal: [0, 0, 1], size: [40, 40], thickness: 0.5}   # all but name have
///       defaults
///       - {name: hill, shape: heightmap, file: hill.png, size: [10, 10, 1]}
///
/// A plane is the slab below it; `position` is a point of its surface, in its middle. A height map is the solid below a
/// surface, centred at `position`, with a floor 0.5 m below its lowest point: a picture (.png, .pgm), whose black is 0
/// and whose white is the third extent, or rows of heights in metres (.txt, .csv; the third extent is a factor and may
/// be missing). The first row has the largest y.
///
/// `position` and `rpy` default to zero; rpy is fixed-axis roll, pitch, yaw (R = Rz Ry Rx), as in URDF. Names must be
/// unique. Mesh files are relative to the scene file and must exist; they are parsed under `guard` when the collision
/// model is built. Throws InputError: missing file, invalid YAML, unknown key or shape (with the nearest valid one), a
/// size that is not positive and finite, a duplicate name, a mesh file of unknown type.
Scene ReadSceneFile(const std::filesystem::path& path, const ReadGuard& guard = {});

/// Returns the keys of a primitive from `shape` on, as ReadSceneFile reads them: "box, size: [..], position: [..], rpy:
/// [..]". "mesh" for a mesh.
std::string FormatPrimitive(const ShapeSpec& shape);

/// Returns roll, pitch and yaw, rad, of a rotation R = Rz Ry Rx.
Eigen::Vector3d RollPitchYaw(const Eigen::Matrix3d& R);

/// Returns true for the suffixes .stl .obj .dae .ply .gltf .glb .off in upper or lower case.
bool IsMeshFile(const std::filesystem::path& path);

}  // namespace legopt
