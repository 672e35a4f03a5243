#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "legopt/generate/building.h"
#include "legopt/generate/fracture.h"

namespace legopt::generate {

/// What the simulation must know of a material.
struct MaterialFacts {
  std::string_view name;  ///< lower case, for files
  double density_kg_m3;   ///< of a solid piece
  double strength;        ///< of the bonds, relative to concrete
};
/// The facts of a material.
MaterialFacts FactsOf(Material material);

/// The simulation. Defaults suit concrete buildings of ten to thirty metres.
struct CollapseOptions {
  double step_s = 0.005;          ///< of the integrator, (0, 0.02]
  int iterations = 40;            ///< of ODE's quick step, 1..1000
  double front_m = 4.5;           ///< distance from the focus within which cells can move at the beginning
  double front_speed_m_s = 2.0;   ///< at which this distance grows
  double tension_pa = 2.0e5;      ///< a bond breaks at this mean tensile stress, for concrete ...
  double shear_pa = 3.0e5;        ///< ... this mean shear stress ...
  double bending_pa = 1.2e6;      ///< ... or this stress by bending and torsion
  double strength_spread = 0.6;   ///< bonds are stronger or weaker by up to this share, 0..1
  double cracked_share = 0.7;     ///< of the bonds near the focus, broken from the start
  double cracked_radius_m = 4.5;  ///< where that share has fallen to 0, linearly
  double friction = 0.7;          ///< Coulomb's coefficient between cells
  std::vector<double> snapshots_s = {0.7, 1.0, 1.6, 3.0};  ///< ascending, > 0
};

/// One cell at one instant.
struct CellState {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();  ///< from where it stood in the intact building
  bool moved = false;                                        ///< by more than half a millimetre at any vertex
  bool gone = false;                                         ///< crushed, or fallen off the edge of the world
};

/// All cells at one instant.
struct Snapshot {
  double time_s = 0.0;           ///< since the collapse began
  std::vector<CellState> cells;  ///< by cell
  int bonds_broken = 0;          ///< so far, those cracked from the start included
};

/// Called now and then with (simulated seconds, of all). May be empty.
using CollapseProgress = std::function<void(double done_s, double total_s)>;

/// Rigid-body simulation (ODE, quick step) of the collapse of a fractured building.
///
/// The failing members vanish at time 0. Cells become bodies when the damage front reaches them; until then they stand
/// fixed, and so an untouched part keeps its exact shape. Bonds between bodies are fixed joints that break when the
/// force or moment they carry exceeds their strength; cells that are no longer joined collide (contacts by exact
/// signed distance of the convex cells). Loose bodies (cars, people, furniture) rest on what is below them.
///
/// Deterministic for one build: single-threaded, ODE's own random numbers are seeded from `seed`; they are global to
/// the process, so two simulations must not run at the same time in one process.
std::vector<Snapshot> SimulateCollapse(const Building& building, const std::vector<Cell>& cells,
                                       const std::vector<Bond>& bonds, const CollapseOptions& options,
                                       std::uint64_t seed, const CollapseProgress& progress);

}  // namespace legopt::generate
