#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "legopt/geometry/internal/mesh.h"
#include "legopt/worldgen/internal/building.h"
#include "legopt/worldgen/internal/fracture.h"

namespace legopt::worldgen {

/// Properties of a material for the simulation.
struct MaterialProperties {
  std::string_view name;  ///< lower case, for files
  double density_kg_m3;   ///< density of the solid material
  double strength;        ///< strength of bonds relative to concrete
};
/// Returns the properties of a material.
MaterialProperties FactsOf(Material material);

/// Options of the simulation. The defaults suit concrete buildings of ten to thirty metres.
struct CollapseOptions {
  double step_s = 0.005;          ///< integration step, (0, 0.02]
  int iterations = 40;            ///< iterations of ODE's quick step, 1..1000
  double front_m = 4.5;           ///< initial radius of the damage front about the focus; only cells inside can move
  double front_speed_m_s = 2.0;   ///< speed of the damage front
  double tension_pa = 2.0e5;      ///< tensile strength of concrete bonds (mean stress)
  double shear_pa = 3.0e5;        ///< shear strength of concrete bonds (mean stress)
  double bending_pa = 1.2e6;      ///< strength of concrete bonds in bending and torsion
  double strength_spread = 0.6;   ///< relative variation of bond strength, 0..1
  double cracked_share = 0.7;     ///< share of bonds at the focus that are broken from the start
  double cracked_radius_m = 4.5;  ///< radius at which that share has fallen linearly to 0
  double friction = 0.7;          ///< Coulomb's coefficient between cells
  std::vector<double> snapshots_s = {0.7, 1.0, 1.6, 3.0};  ///< times of the snapshots, ascending, > 0
};

/// State of one cell at one instant.
struct CellState {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();  ///< displacement from the intact building
  bool moved = false;                                        ///< any vertex moved by more than half a millimetre
  bool gone = false;                                         ///< crushed, or fallen off the ground plate
};

/// States of all cells at one instant.
struct Snapshot {
  double time_s = 0.0;           ///< since the start of the collapse
  std::vector<CellState> cells;  ///< per cell
  int bonds_broken = 0;          ///< broken bonds so far, including those cracked from the start
};

/// Progress callback in simulated seconds. May be empty.
using CollapseProgress = std::function<void(double done_s, double total_s)>;

/// Simulates the collapse of a fractured building with rigid bodies (ODE, quick step).
///
/// The failing members are removed at time 0. Cells become bodies when the damage front reaches them; until then they
/// are fixed, so that undamaged parts keep their exact shape. Bonds between bodies are fixed joints that break when
/// their force or moment exceeds their strength. Cells without a bond collide (contacts by exact signed distance of the
/// convex cells). Loose bodies (cars, people, furniture) rest on the parts below them.
///
/// Deterministic for one build: single-threaded, with ODE's random numbers seeded from `seed`. These are global to the
/// process, so that only one simulation may run per process at a time.
std::vector<Snapshot> SimulateCollapse(const Building& building, const std::vector<Cell>& cells,
                                       const std::vector<Bond>& bonds, const CollapseOptions& options,
                                       std::uint64_t seed, const CollapseProgress& progress);

/// One convex solid of a scenario, world frame; coordinates are representable as float.
struct Piece {  ///< vertices of the convex hull, m
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::vector<int>> faces;  ///< see Cell
  int member = -1;                      ///< index into Building::members
};

/// Returns the solids of a snapshot: undamaged members as a whole, and of the others every remaining cell at its
/// simulated pose. Cells more than `margin_m` outside the plan are omitted.
std::vector<Piece> PiecesOf(const Building& building, const std::vector<Cell>& cells, const Snapshot& snapshot,
                            double margin_m = 6.0);

/// Merges all pieces into one mesh: each is a closed surface with outward winding; faces are split into triangle fans.
/// Vertices of different pieces are separate. `piece_of_triangle` may be null.
TriangleMesh MeshOf(const std::vector<Piece>& pieces, std::vector<int>* piece_of_triangle = nullptr);

}  // namespace legopt::worldgen
