#include "client/tracking/rigid_body_world.h"

#include <ode/ode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "legopt/dynamics/internal/body_mass.h"
#include "legopt/geometry/internal/mesh.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

constexpr double kBall_m = 5e-3;  // radius of the balls of soles and palms
constexpr int kMostContacts = 4;  // per ball

Eigen::Vector3d VectorOf(const dReal* v) { return {v[0], v[1], v[2]}; }

Eigen::Quaterniond RotationOf(dBodyID body) {
  const dReal* q = dBodyGetQuaternion(body);
  return {q[0], q[1], q[2], q[3]};
}

/// Makes properties of a body without mass ones that ODE accepts.
BodyMass Simulable(BodyMass body) {
  constexpr double kLeastInertia_kg_m2 = 1e-6;
  body.inertia += kLeastInertia_kg_m2 * Eigen::Matrix3d::Identity();
  body.mass = std::max(body.mass, RigidBodyWorld::kLeastMass_kg);
  return body;
}

/// A ball of a contact, and the body that it is part of.
struct Ball {
  std::string contact;
  int body = 0;
  Eigen::Vector3d centre;  ///< centre in the body's frame
  double radius_m = 0.0;
};

std::vector<Ball> BallsOf(const Contact& contact, const RobotModel& robot) {
  std::vector<Ball> balls;
  const Eigen::Isometry3d& X_BL = robot.link_in_body(contact.link_index);
  const int body = robot.link_body(contact.link_index);
  if (contact.facts().shape == ContactShape::kBall) {
    return {{contact.name, body, X_BL * contact.X_LC.translation(), std::max(contact.radius_m, kBall_m)}};
  }
  if (contact.facts().shape == ContactShape::kBar) return {};
  for (const Eigen::Vector3d& point_L : contact.points_L) {
    Eigen::Vector3d point_C = contact.X_LC.inverse(Eigen::Isometry) * point_L;
    point_C.z() = kBall_m;
    balls.push_back({contact.name, body, X_BL * (contact.X_LC * point_C), kBall_m});
  }
  return balls;
}

}  // namespace

class RigidBodyWorld::Impl {
 public:
  Impl(const Dataset& dataset, Eigen::Ref<const Eigen::VectorXd> x) : dataset_(dataset), robot_(dataset.robot()) {
    if (robot_.has_followers()) {
      throw InputError({"robot", "joints", robot_.name(), "has joints that follow others, which are not simulated",
                        "choose another robot"});
    }
    dInitODE2(0);
    world_ = dWorldCreate();
    constexpr double kSoftness = 1e-7;  // keeps redundant constraints, such as those of four-point feet, solvable
    dWorldSetCFM(world_, kSoftness);
    dSetMessageHandler([](int, const char*, va_list) {});  // ODE prints when a step leaves a residual
    dWorldSetGravity(world_, 0.0, 0.0, -dataset.gravity_m_s2());
    contacts_ = dJointGroupCreate(0);
    AddBodies(x);
    AddJoints();
    AddScene();
    for (const Contact& contact : dataset.contacts()) {
      friction_[contact.name] = contact.friction;
      for (Ball& ball : BallsOf(contact, robot_)) balls_.push_back(std::move(ball));
    }
  }
  ~Impl() {
    dGeomDestroy(ball_);
    dGeomDestroy(scene_);
    dGeomTriMeshDataDestroy(scene_data_);
    dJointGroupDestroy(contacts_);
    dWorldDestroy(world_);
    dCloseODE();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void Hold(const Stance& stance) {
    std::map<std::string, dJointID> kept;
    for (const ContactTarget& target : stance.contacts) {
      const Contact& contact = dataset_.contact(target.contact);
      friction_[contact.name] = target.friction.value_or(contact.friction);
      if (contact.facts().shape != ContactShape::kBar) continue;
      const auto known = grips_.extract(contact.name);
      kept[contact.name] = known.empty() ? Grip(contact) : known.mapped();
    }
    for (const auto& [name, joint] : grips_) dJointDestroy(joint);
    grips_ = std::move(kept);
  }

  void Step(Eigen::Ref<const Eigen::VectorXd> torques, double step_s) {
    for (int body = 1; body < robot_.num_bodies(); ++body) ApplyTorque(body, torques[JointOf(body).dof]);
    for (const Ball& ball : balls_) Collide(ball);
    dWorldStep(world_, step_s);
    dJointGroupEmpty(contacts_);
  }

  /// Measures the state; `x` holds that of the step before.
  void Measure(Eigen::VectorXd* x, Eigen::VectorXd* velocity) const {
    for (int body = 1; body < robot_.num_bodies(); ++body) {
      const auto [position, speed] = StateOf(body, (*x)[JointOf(body).dof]);
      (*x)[JointOf(body).dof] = position;
      (*velocity)[JointOf(body).dof] = speed;
    }
    const Eigen::Isometry3d base = PoseOf(0);
    auto parts = MutablePartsOf(*x);
    parts.base_position() = base.translation();
    parts.set_base_quaternion(Eigen::Quaterniond(base.linear()).normalized());
    velocity->segment<3>(robot_.base_position_index()) = SpeedAt(0, base.translation());
    velocity->segment<3>(robot_.base_rotation_index()) = SpinOf(0);
  }

 private:
  const Joint& JointOf(int body) const { return robot_.joints()[static_cast<std::size_t>(robot_.body_joint(body))]; }
  dBodyID BodyOf(int body) const { return bodies_[static_cast<std::size_t>(body)]; }

  void AddBodies(Eigen::Ref<const Eigen::VectorXd> x) {
    Kinematics kinematics(robot_);
    kinematics.UpdatePoses(x);
    const std::vector<BodyMass> masses = BodyMassesOf(robot_);
    for (int body = 0; body < robot_.num_bodies(); ++body) {
      const BodyMass properties = Simulable(masses[static_cast<std::size_t>(body)]);
      const Eigen::Isometry3d& pose = kinematics.link_pose(body == 0 ? 0 : JointOf(body).child_link);
      const Eigen::Quaterniond q(pose.linear());
      const Eigen::Vector3d com = pose * properties.com;
      const dBodyID created = dBodyCreate(world_);
      dMass mass;
      const Eigen::Matrix3d& i = properties.inertia;
      dMassSetParameters(&mass, properties.mass, 0, 0, 0, i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(0, 2), i(1, 2));
      dBodySetMass(created, &mass);
      dBodySetPosition(created, com.x(), com.y(), com.z());
      const std::array<dReal, 4> quaternion = {q.w(), q.x(), q.y(), q.z()};
      dBodySetQuaternion(created, quaternion.data());
      bodies_.push_back(created);
      coms_.push_back(properties.com);
    }
  }

  void AddJoints() {
    for (int body = 1; body < robot_.num_bodies(); ++body) {
      const Eigen::Vector3d axis = AxisOf(body), anchor = PoseOf(body).translation();
      const dBodyID child = BodyOf(body), parent = BodyOf(robot_.body_parent(body));
      if (JointOf(body).type == JointType::kPrismatic) {
        const dJointID joint = dJointCreateSlider(world_, nullptr);
        dJointAttach(joint, child, parent);
        dJointSetSliderAxis(joint, axis.x(), axis.y(), axis.z());
      } else {
        const dJointID joint = dJointCreateHinge(world_, nullptr);
        dJointAttach(joint, child, parent);
        dJointSetHingeAnchor(joint, anchor.x(), anchor.y(), anchor.z());
        dJointSetHingeAxis(joint, axis.x(), axis.y(), axis.z());
      }
    }
  }

  void AddScene() {
    const TriangleMesh mesh = CollectSceneTriangles(dataset_.scene());
    for (const Eigen::Vector3d& vertex : mesh.vertices) vertices_.insert(vertices_.end(), vertex.begin(), vertex.end());
    for (const std::array<int, 3>& triangle : mesh.triangles) {
      for (const int corner : triangle) indices_.push_back(static_cast<dTriIndex>(corner));
    }
    scene_data_ = dGeomTriMeshDataCreate();
    dGeomTriMeshDataBuildDouble(scene_data_, vertices_.data(), 3 * sizeof(double),
                                static_cast<int>(mesh.vertices.size()), indices_.data(),
                                static_cast<int>(indices_.size()), 3 * sizeof(dTriIndex));
    scene_ = dCreateTriMesh(nullptr, scene_data_, nullptr, nullptr, nullptr);
    ball_ = dCreateSphere(nullptr, kBall_m);
  }

  /// Holds the hand where it is.
  dJointID Grip(const Contact& contact) {
    const int body = robot_.link_body(contact.link_index);
    const Eigen::Vector3d place = PoseOf(body) * (robot_.link_in_body(contact.link_index) * contact.X_LC.translation());
    const dJointID joint = dJointCreateBall(world_, nullptr);
    dJointAttach(joint, BodyOf(body), nullptr);
    dJointSetBallAnchor(joint, place.x(), place.y(), place.z());
    return joint;
  }

  /// Pose of a body's frame, that of its first link.
  Eigen::Isometry3d PoseOf(int body) const {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = RotationOf(BodyOf(body)).toRotationMatrix();
    pose.translation() =
        VectorOf(dBodyGetPosition(BodyOf(body))) - pose.linear() * coms_[static_cast<std::size_t>(body)];
    return pose;
  }
  Eigen::Vector3d SpinOf(int body) const { return VectorOf(dBodyGetAngularVel(BodyOf(body))); }
  Eigen::Vector3d SpeedAt(int body, const Eigen::Vector3d& place) const {
    const Eigen::Vector3d com = VectorOf(dBodyGetPosition(BodyOf(body)));
    return VectorOf(dBodyGetLinearVel(BodyOf(body))) + SpinOf(body).cross(place - com);
  }
  /// Axis of the joint that moves a body, in the world: the same in the frames of joint and child.
  Eigen::Vector3d AxisOf(int body) const { return PoseOf(body).linear() * JointOf(body).axis; }

  /// Position and velocity of the joint that moves a body. An angle is the one nearest to `before`.
  std::pair<double, double> StateOf(int body, double before) const {
    const Joint& joint = JointOf(body);
    const int parent = robot_.body_parent(body);
    const Eigen::Isometry3d frame = PoseOf(parent) * robot_.link_in_body(joint.parent_link) * joint.origin;
    const Eigen::Isometry3d child = PoseOf(body);
    const Eigen::Vector3d axis = AxisOf(body);
    if (joint.type == JointType::kPrismatic) {
      const Eigen::Vector3d place = child.translation();
      return {axis.dot(place - frame.translation()), axis.dot(SpeedAt(body, place) - SpeedAt(parent, place))};
    }
    const Eigen::Quaterniond q(frame.linear().transpose() * child.linear());
    const double angle = 2.0 * std::atan2(joint.axis.dot(q.vec()), q.w());
    constexpr double kTurn = 2.0 * std::numbers::pi;
    return {angle + kTurn * std::round((before - angle) / kTurn), axis.dot(SpinOf(body) - SpinOf(parent))};
  }

  void ApplyTorque(int body, double torque) {
    const Eigen::Vector3d effect = torque * AxisOf(body);
    const dBodyID child = BodyOf(body), parent = BodyOf(robot_.body_parent(body));
    if (JointOf(body).type == JointType::kPrismatic) {
      const Eigen::Vector3d p = PoseOf(body).translation();
      dBodyAddForceAtPos(child, effect.x(), effect.y(), effect.z(), p.x(), p.y(), p.z());
      dBodyAddForceAtPos(parent, -effect.x(), -effect.y(), -effect.z(), p.x(), p.y(), p.z());
    } else {
      dBodyAddTorque(child, effect.x(), effect.y(), effect.z());
      dBodyAddTorque(parent, -effect.x(), -effect.y(), -effect.z());
    }
  }

  void Collide(const Ball& ball) {
    const Eigen::Vector3d centre = PoseOf(ball.body) * ball.centre;
    dGeomSphereSetRadius(ball_, ball.radius_m);
    dGeomSetPosition(ball_, centre.x(), centre.y(), centre.z());
    std::array<dContact, kMostContacts> found{};
    const int count = dCollide(ball_, scene_, kMostContacts, &found[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      dContact& contact = found.at(static_cast<std::size_t>(i));
      contact.surface.mode = dContactApprox1;  // the friction pyramid turns with the normal force
      contact.surface.mu = friction_.at(ball.contact);
      dJointAttach(dJointCreateContact(world_, contacts_, &contact), BodyOf(ball.body), nullptr);
    }
  }

  const Dataset& dataset_;
  const RobotModel& robot_;
  dWorldID world_ = nullptr;
  dJointGroupID contacts_ = nullptr;  ///< contacts of one step
  std::vector<dBodyID> bodies_;
  std::vector<Eigen::Vector3d> coms_;  ///< per body, in its frame
  std::vector<Ball> balls_;
  std::map<std::string, double> friction_;  ///< friction coefficient by contact
  std::map<std::string, dJointID> grips_;   ///< joint by gripping contact
  std::vector<double> vertices_;            ///< scene; ODE keeps the address
  std::vector<dTriIndex> indices_;          ///< three per triangle; ODE keeps the address
  dTriMeshDataID scene_data_ = nullptr;
  dGeomID scene_ = nullptr, ball_ = nullptr;
};

RigidBodyWorld::RigidBodyWorld(const Dataset& dataset, Eigen::Ref<const Eigen::VectorXd> x)
    : impl_(std::make_unique<Impl>(dataset, x)),
      x_(x),
      velocity_(Eigen::VectorXd::Zero(dataset.robot().tangent_size())) {
  Measure();
}

RigidBodyWorld::~RigidBodyWorld() = default;

void RigidBodyWorld::Hold(const Stance& contacts) { impl_->Hold(contacts); }

void RigidBodyWorld::Step(Eigen::Ref<const Eigen::VectorXd> torques, double step_s) {
  impl_->Step(torques, step_s);
  Measure();
}

void RigidBodyWorld::Measure() { impl_->Measure(&x_, &velocity_); }

}  // namespace legopt::client
