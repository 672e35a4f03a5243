#include "legopt/judge/internal/holding_diagnostic.h"

namespace legopt {
namespace {

/// Lists the contacts that carry, without forces.
std::vector<ContactHolding> CarryingContacts(const Dataset& dataset, const Stance& stance,
                                             const std::vector<TouchedSurface>& surfaces) {
  std::vector<ContactHolding> contacts;
  for (const ContactTarget& target : stance.contacts) {
    if (!target.carries) continue;
    const TouchedSurface& surface = surfaces[contacts.size()];
    ContactHolding& contact = contacts.emplace_back();
    contact.contact = target.contact;
    contact.normal_W = surface.axes_W.col(2);
    if (dataset.contact(target.contact).facts().forces != ContactForces::kBounded) contact.friction = surface.friction;
  }
  return contacts;
}

void AddForces(const StanceForces& forces, HoldingDiagnostic* diagnostic) {
  for (std::size_t k = 0; k < diagnostic->torques.forces_N.size(); ++k) {
    const Eigen::Vector3d& force_N = diagnostic->torques.forces_N[k];
    const StanceForces::Point& point = forces.points()[k];
    constexpr double kNoForce_N = 1e-3;
    if (force_N.norm() < kNoForce_N) continue;
    diagnostic->contacts[static_cast<std::size_t>(point.surface)].forces.push_back({point.position_W, force_N});
  }
}

void AddCollapse(const CollapseMotion& motion, const std::vector<TouchedSurface>& surfaces, const StanceForces& forces,
                 const Eigen::Vector3d& com_W, HoldingDiagnostic* diagnostic) {
  const std::vector<SurfaceMovement> movements = MovementsOf(motion, surfaces, forces);
  for (std::size_t s = 0; s < movements.size(); ++s) diagnostic->contacts[s].moves = movements[s];
  diagnostic->com_direction_W = motion.At(com_W).normalized();
}

/// Returns how the robot falls: without turning if no forces of these directions carry its weight, wherever they act,
/// because that motion is the easiest to see; else the motion that the program of this posture proves.
std::optional<CollapseMotion> FindMotion(const std::vector<TouchedSurface>& surfaces, const StanceForces& forces,
                                         const Eigen::Vector3d& com_W, StaticEquilibrium* equilibrium) {
  std::vector<TouchedSurface> concurrent = surfaces;
  for (TouchedSurface& surface : concurrent) {
    for (Eigen::Vector3d& point_W : surface.points_W) point_W = com_W;
  }
  std::optional<CollapseMotion> motion = equilibrium->FindCollapse(StanceForces(concurrent), com_W);
  if (!motion) return equilibrium->FindCollapse(forces, com_W);
  motion->turn.setZero();
  return motion;
}

}  // namespace

HoldingDiagnostic ExplainHolding(const Dataset& dataset, const Stance& stance, const Kinematics& kinematics,
                                 HoldingProbe* holding) {
  HoldingDiagnostic diagnostic;
  const Holding measured = holding->Measure(stance, kinematics);
  if (!kinematics.com().allFinite()) return diagnostic;
  const std::vector<TouchedSurface> surfaces = SurfacesOf(dataset, stance, &kinematics);
  const StanceForces forces(surfaces);
  diagnostic.contacts = CarryingContacts(dataset, stance, surfaces);
  diagnostic.polygon_W = holding->polygon();
  diagnostic.balanced = measured.balanced();
  StaticEquilibrium equilibrium(dataset.robot(), dataset.gravity_m_s2());
  if (diagnostic.balanced) {
    diagnostic.torques = equilibrium.ComputeLeastForces(forces, kinematics);
    if (!measured.within_torques()) diagnostic.overloaded = diagnostic.torques.decisive_dofs;
    AddForces(forces, &diagnostic);
    return diagnostic;
  }
  const std::optional<CollapseMotion> motion = FindMotion(surfaces, forces, kinematics.com(), &equilibrium);
  if (motion) AddCollapse(*motion, surfaces, forces, kinematics.com(), &diagnostic);
  return diagnostic;
}

}  // namespace legopt
