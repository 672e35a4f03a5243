#include "legopt/worldgen/internal/collapse.h"

#include <ode/ode.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "legopt/geometry/internal/ode_world.h"
#include "legopt/math/random_numbers.h"
#include "legopt/worldgen/internal/fracture.h"

namespace legopt::worldgen {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// RAII wrapper of an ODE world.
class World {
 public:
  World() : world_(dWorldCreate()), contacts_(dJointGroupCreate(0)) {}
  ~World() {
    dJointGroupDestroy(contacts_);
    dWorldDestroy(world_);
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  dWorldID world() const { return world_; }
  dJointGroupID contacts() const { return contacts_; }

 private:
  dWorldID world_;
  dJointGroupID contacts_;
};

struct BondJoint {
  dJointID id = nullptr;
  dJointFeedback feedback{};
  Vector3d force = Vector3d::Zero();   ///< low-pass filtered
  Vector3d moment = Vector3d::Zero();  ///< low-pass filtered, about the bond's centre
  double strength = 1.0;
  double age_s = 0.0;
  bool broken = false;
};

class Simulation {
 public:
  Simulation(const Building& building, const std::vector<Cell>& cells, const std::vector<Bond>& bonds,
             const CollapseOptions& options, std::uint64_t seed)
      : building_(building),
        cells_(cells),
        bonds_(bonds),
        options_(options),
        generator_(seed),
        contacts_(cells),
        bodies_(cells.size(), nullptr),
        rest_(cells.size()),
        owner_(cells.size()),
        active_(cells.size(), false),
        gone_(cells.size(), false),
        joints_(bonds.size()) {
    Configure();
    GroupProps();
    DrawStrengths();
    Crush();
  }

  void Advance() {
    Activate();
    AddContacts();
    dWorldQuickStep(world_.world(), options_.step_s);
    dJointGroupEmpty(world_.contacts());
    time_s_ += options_.step_s;
    ReadPoses();
    BreakBonds();
  }

  double time_s() const { return time_s_; }
  Snapshot Take() const;

 private:
  void Configure();
  void GroupProps();
  void DrawStrengths();
  void Crush();
  void Activate();
  void MakeBody(int owner);
  void MakeJoint(size_t bond);
  void AddContacts();
  void ReadPoses();
  void BreakBonds();
  bool Overloaded(size_t k);  // k: index of the bond
  const Member& MemberOf(int cell) const {
    return building_.members[static_cast<size_t>(cells_[static_cast<size_t>(cell)].member)];
  }
  dBodyID BodyOf(int cell) const { return bodies_[static_cast<size_t>(owner_[static_cast<size_t>(cell)])]; }
  Isometry3d MotionOf(int cell) const;

  const Building& building_;
  const std::vector<Cell>& cells_;
  const std::vector<Bond>& bonds_;
  const CollapseOptions& options_;
  std::mt19937_64 generator_;
  World world_;
  CellContacts contacts_;
  std::vector<dBodyID> bodies_;  ///< per owner; null while fixed
  std::vector<Vector3d> rest_;   ///< centre of mass in the intact building, per owner
  std::vector<int> owner_;       ///< per cell: first cell of the same body
  std::vector<bool> active_;
  std::vector<bool> gone_;
  std::vector<BondJoint> joints_;
  std::set<std::pair<int, int>> joined_;  ///< pairs of cells with an unbroken bond
  double time_s_ = 0.0;
};

void Simulation::Configure() {
  constexpr double kGravity = 9.81;
  constexpr double kErp = 0.3;
  constexpr double kCfm = 1e-9;
  constexpr double kOverRelaxation = 1.3;
  constexpr double kPushOut_m_s = 0.4;
  constexpr double kLayer_m = 5e-4;
  constexpr double kDamping = 0.002;
  dWorldID world = world_.world();
  dRandSetSeed(static_cast<unsigned long>(generator_() >> 32));
  dWorldSetGravity(world, 0.0, 0.0, -kGravity);
  dWorldSetERP(world, kErp);
  dWorldSetCFM(world, kCfm);
  dWorldSetQuickStepNumIterations(world, options_.iterations);
  dWorldSetQuickStepW(world, kOverRelaxation);
  dWorldSetContactMaxCorrectingVel(world, kPushOut_m_s);
  dWorldSetContactSurfaceLayer(world, kLayer_m);
  dWorldSetLinearDamping(world, kDamping);
  dWorldSetAngularDamping(world, kDamping);
  dWorldSetAutoDisableFlag(world, 0);
}

void Simulation::GroupProps() {
  std::map<int, int> first;
  for (size_t i = 0; i < cells_.size(); ++i) {
    const int cell = static_cast<int>(i);
    const int prop = MemberOf(cell).prop;
    owner_[i] = prop < 0 ? cell : first.try_emplace(prop, cell).first->second;
  }
}

void Simulation::DrawStrengths() {
  for (size_t k = 0; k < bonds_.size(); ++k) {
    const Bond& bond = bonds_[k];
    const double material =
        std::min(FactsOf(MemberOf(bond.a).material).strength, FactsOf(MemberOf(bond.b).material).strength);
    joints_[k].strength = material * (1.0 + options_.strength_spread * (2.0 * UniformRandom(generator_) - 1.0));
    const double distance = building_.FocusDistance(bond.centre);
    const bool cracked =
        UniformRandom(generator_) < options_.cracked_share * (1.0 - distance / options_.cracked_radius_m);
    joints_[k].broken = cracked;
    if (!cracked) joined_.emplace(bond.a, bond.b);
  }
}

void Simulation::Crush() {
  for (size_t i = 0; i < cells_.size(); ++i) {
    const int cell = static_cast<int>(i);
    if (!MemberOf(cell).fails) continue;
    gone_[i] = true;
    contacts_.Remove(cell);
  }
  for (size_t k = 0; k < bonds_.size(); ++k) {
    const Bond& bond = bonds_[k];
    if (!gone_[static_cast<size_t>(bond.a)] && !gone_[static_cast<size_t>(bond.b)]) continue;
    joints_[k].broken = true;
    joined_.erase({bond.a, bond.b});
  }
}

void Simulation::Activate() {
  const double reach = options_.front_m + options_.front_speed_m_s * time_s_;
  std::vector<int> fresh;
  for (size_t i = 0; i < cells_.size(); ++i) {
    const auto owner = static_cast<size_t>(owner_[i]);
    const int cell = static_cast<int>(i);
    if (active_[i] || gone_[i] || MemberOf(cell).fixed) continue;
    if (bodies_[owner] == nullptr && building_.FocusDistance(cells_[owner].centroid) > reach) continue;
    if (bodies_[owner] == nullptr) MakeBody(static_cast<int>(owner));
    active_[i] = true;
    fresh.push_back(cell);
  }
  if (fresh.empty()) return;
  for (size_t k = 0; k < bonds_.size(); ++k) {
    const bool touched = active_[static_cast<size_t>(bonds_[k].a)] || active_[static_cast<size_t>(bonds_[k].b)];
    if (joints_[k].broken || !touched) continue;
    const bool changed = std::binary_search(fresh.begin(), fresh.end(), bonds_[k].a) ||
                         std::binary_search(fresh.begin(), fresh.end(), bonds_[k].b);
    if (changed) MakeJoint(k);
  }
}

/// Creates the body of an owner. Mass properties are those of a box around the cells, which are blocks and plates.
void Simulation::MakeBody(int owner) {
  double mass_kg = 0.0;
  Vector3d moment = Vector3d::Zero();
  Eigen::AlignedBox3d box;
  for (size_t i = 0; i < cells_.size(); ++i) {
    if (owner_[i] != owner) continue;
    const double kg = cells_[i].volume_m3 * FactsOf(MemberOf(static_cast<int>(i)).material).density_kg_m3;
    mass_kg += kg;
    moment += kg * cells_[i].centroid;
    for (const Vector3d& vertex : cells_[i].vertices) box.extend(vertex);
  }
  const auto index = static_cast<size_t>(owner);
  rest_[index] = moment / mass_kg;
  dMass mass;
  dMassSetBoxTotal(&mass, mass_kg, box.sizes().x(), box.sizes().y(), box.sizes().z());
  dBodyID body = dBodyCreate(world_.world());
  dBodySetMass(body, &mass);
  dBodySetPosition(body, rest_[index].x(), rest_[index].y(), rest_[index].z());
  bodies_[index] = body;
}

void Simulation::MakeJoint(size_t bond) {
  BondJoint& joint = joints_[bond];
  if (joint.id != nullptr) dJointDestroy(joint.id);  // its other cell was part of the static world until now
  joint.id = dJointCreateFixed(world_.world(), nullptr);
  dJointAttach(joint.id, BodyOf(bonds_[bond].a), BodyOf(bonds_[bond].b));
  dJointSetFixed(joint.id);
  dJointSetFeedback(joint.id, &joint.feedback);
  joint.feedback = {};
  joint.age_s = 0.0;
}

void Simulation::AddContacts() {
  for (const auto& [a, b] : contacts_.Pairs(active_)) {
    if (owner_[static_cast<size_t>(a)] == owner_[static_cast<size_t>(b)] || joined_.count({a, b}) > 0) continue;
    for (const CellContacts::Point& point : contacts_.Touch(a, b)) {
      dContact contact{};
      contact.surface.mode = dContactApprox1 | dContactSoftCFM | dContactSoftERP;
      contact.surface.mu = options_.friction;
      contact.surface.soft_erp = 0.2;
      contact.surface.soft_cfm = 1e-8;
      for (int axis = 0; axis < 3; ++axis) {
        contact.geom.pos[axis] = point.position[axis];
        contact.geom.normal[axis] = point.normal[axis];
      }
      contact.geom.depth = point.depth_m;
      dJointID joint = dJointCreateContact(world_.world(), world_.contacts(), &contact);
      dJointAttach(joint, BodyOf(a), BodyOf(b));
    }
  }
}

Isometry3d Simulation::MotionOf(int cell) const {
  const dBodyID body = BodyOf(cell);
  if (body == nullptr) return Isometry3d::Identity();
  const dReal* q = dBodyGetQuaternion(body);
  const dReal* p = dBodyGetPosition(body);
  const Vector3d& rest = rest_[static_cast<size_t>(owner_[static_cast<size_t>(cell)])];
  return Eigen::Translation3d(p[0], p[1], p[2]) * Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized() *
         Eigen::Translation3d(-rest);
}

void Simulation::ReadPoses() {
  constexpr double kAbyss_m = -3.0;
  for (size_t i = 0; i < cells_.size(); ++i) {
    if (!active_[i] || gone_[i]) continue;
    const int cell = static_cast<int>(i);
    contacts_.Place(cell, MotionOf(cell));
    if (contacts_.bounds(cell).max().z() > kAbyss_m) continue;
    gone_[i] = true;
    active_[i] = false;
    contacts_.Remove(cell);
  }
}

/// Returns true if a stress exceeds the bond's strength. Mean stresses on the bond's area come from the joint's
/// reaction, filtered over a few steps because the quick step's forces are noisy. Bending assumes a square section:
/// modulus A^1.5 / 6.
bool Simulation::Overloaded(size_t k) {
  const Bond& bond = bonds_[k];
  BondJoint& joint = joints_[k];
  const bool first = BodyOf(bond.a) != nullptr;
  const dReal* f = joint.feedback.f1;  // ODE stores the static world as second body, so the first body is never the
                                       // world
  const dReal* t = joint.feedback.t1;
  const dReal* p = dBodyGetPosition(first ? BodyOf(bond.a) : BodyOf(bond.b));
  const int cell = first ? bond.a : bond.b;
  const Isometry3d motion = MotionOf(cell);
  const Vector3d force(f[0], f[1], f[2]);
  const Vector3d arm = motion * bond.centre - Vector3d(p[0], p[1], p[2]);
  constexpr double kMemory = 0.75;
  joint.force = kMemory * joint.force + (1.0 - kMemory) * force;
  joint.moment = kMemory * joint.moment + (1.0 - kMemory) * (Vector3d(t[0], t[1], t[2]) - arm.cross(force));
  constexpr double kSettled_s = 0.05;
  joint.age_s += options_.step_s;
  if (joint.age_s < kSettled_s) return false;
  const Vector3d normal = motion.linear() * bond.normal;
  const double pull = (first ? 1.0 : -1.0) * normal.dot(joint.force);  // the bond pulls its first cell along the normal
  const double shear = (joint.force - normal.dot(joint.force) * normal).norm();
  const double bending = 6.0 * joint.moment.norm() / std::pow(bond.area_m2, 1.5);
  return pull / bond.area_m2 > joint.strength * options_.tension_pa ||
         shear / bond.area_m2 > joint.strength * options_.shear_pa || bending > joint.strength * options_.bending_pa;
}

void Simulation::BreakBonds() {
  for (size_t k = 0; k < bonds_.size(); ++k) {
    BondJoint& joint = joints_[k];
    if (joint.id == nullptr || joint.broken || !Overloaded(k)) continue;
    joint.broken = true;
    dJointDestroy(joint.id);
    joint.id = nullptr;
    joined_.erase({bonds_[k].a, bonds_[k].b});
  }
}

Snapshot Simulation::Take() const {
  Snapshot snapshot;
  snapshot.time_s = time_s_;
  constexpr double kStill_m = 5e-4;
  for (size_t i = 0; i < cells_.size(); ++i) {
    CellState state;
    state.gone = gone_[i];
    if (active_[i]) state.motion = MotionOf(static_cast<int>(i));
    for (const Vector3d& vertex : cells_[i].vertices) {
      state.moved = state.moved || (state.motion * vertex - vertex).norm() > kStill_m;
    }
    if (!state.moved) state.motion.setIdentity();
    snapshot.cells.push_back(state);
  }
  for (const BondJoint& joint : joints_) snapshot.bonds_broken += joint.broken ? 1 : 0;
  return snapshot;
}

}  // namespace

MaterialProperties FactsOf(Material material) {
  switch (material) {
    case Material::kGround:
      return {"ground", 2400.0, 1.0};
    case Material::kConcrete:
      return {"concrete", 2400.0, 1.0};
    case Material::kMasonry:
      return {"masonry", 1900.0, 0.6};
    case Material::kTimber:
      return {"timber", 600.0, 0.8};
    case Material::kCar:
      return {"car", 180.0, 1.0};
    case Material::kPerson:
      return {"person", 1000.0, 1.0};
  }
  return {"", 1000.0, 1.0};
}

std::vector<Snapshot> SimulateCollapse(const Building& building, const std::vector<Cell>& cells,
                                       const std::vector<Bond>& bonds, const CollapseOptions& options,
                                       std::uint64_t seed, const CollapseProgress& progress) {
  UseOdeOnThisThread();
  Simulation simulation(building, cells, bonds, options, seed);
  std::vector<Snapshot> snapshots;
  const double half_step = 0.5 * options.step_s;
  for (const double until : options.snapshots_s) {
    while (simulation.time_s() < until - half_step) {
      simulation.Advance();
      if (progress) progress(simulation.time_s(), options.snapshots_s.back());
    }
    snapshots.push_back(simulation.Take());
  }
  return snapshots;
}

namespace {

Piece PieceOf(const Cell& cell, const Eigen::Isometry3d& motion) {
  Piece piece{.vertices = {}, .faces = cell.faces, .member = cell.member};
  for (const Vector3d& vertex : cell.vertices) {
    // Rounded as in the mesh file, so that checks apply to the vertices that will be loaded.
    piece.vertices.emplace_back((motion * vertex).cast<float>().cast<double>());
  }
  return piece;
}

}  // namespace

std::vector<Piece> PiecesOf(const Building& building, const std::vector<Cell>& cells, const Snapshot& snapshot,
                            double margin_m) {
  std::vector<bool> whole(building.members.size(), true);
  for (size_t i = 0; i < cells.size(); ++i) {
    const CellState& state = snapshot.cells[i];
    if (state.moved || state.gone) whole[static_cast<size_t>(cells[i].member)] = false;
  }
  Eigen::AlignedBox2d world = building.plan;
  world.min().array() -= margin_m;
  world.max().array() += margin_m;
  std::vector<Piece> pieces;
  int last_whole = -1;
  for (size_t i = 0; i < cells.size(); ++i) {
    const CellState& state = snapshot.cells[i];
    const int member = cells[i].member;
    if (whole[static_cast<size_t>(member)]) {
      if (member == last_whole) continue;
      last_whole = member;
      const Cell cell = WholeCell(building.members[static_cast<size_t>(member)], member);
      pieces.push_back(PieceOf(cell, Eigen::Isometry3d::Identity()));
    } else if (!state.gone && world.contains(Eigen::Vector2d((state.motion * cells[i].centroid).head<2>()))) {
      pieces.push_back(PieceOf(cells[i], state.motion));
    }
  }
  return pieces;
}

TriangleMesh MeshOf(const std::vector<Piece>& pieces, std::vector<int>* piece_of_triangle) {
  TriangleMesh mesh;
  for (size_t p = 0; p < pieces.size(); ++p) {
    const int first = static_cast<int>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), pieces[p].vertices.begin(), pieces[p].vertices.end());
    for (const std::vector<int>& face : pieces[p].faces) {
      for (size_t k = 1; k + 1 < face.size(); ++k) {
        mesh.triangles.push_back({first + face[0], first + face[k], first + face[k + 1]});
        if (piece_of_triangle != nullptr) piece_of_triangle->push_back(static_cast<int>(p));
      }
    }
  }
  return mesh;
}

}  // namespace legopt::worldgen
