#include "client/report/motion_files.h"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "client/report/listing.h"
#include "legopt/input/json.h"
#include "legopt/robot/configuration.h"
#include "legopt/statics/stance_forces.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMotionFileFormat = 1;

/// Returns 0 for -0.
double Unsigned0(double value) { return value + 0.0; }

template <class Vector>
Json NumbersOf(const Vector& vector) {
  Json json = Json::array();
  for (const double value : vector) json.push_back(std::isfinite(value) ? Json(Unsigned0(value)) : Json());
  return json;
}

Json QuaternionJson(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// Members that every JSON file begins with.
Json HeadOf(const std::string& kind, const Dataset& dataset, const MotionOrigin& origin, const SampledMotion& motion) {
  return {{"format", kMotionFileFormat},     {"kind", kind},
          {"robot", dataset.robot().name()}, {"dataset", {{"name", dataset.name()}, {"hash", dataset.content_hash()}}},
          {"task", ToString(origin.task)},   {"problem", origin.problem_id},
          {"method", origin.method},         {"duration_s", motion.timing.shortest_s}};
}

/// Names of the contacts that transmit forces during a motion, in alphabetical order.
std::set<std::string> ContactsOf(const SampledMotion& motion) {
  std::set<std::string> names;
  for (const MotionSample& sample : motion.samples) {
    for (const ContactForce& force : sample.forces) names.insert(force.contact);
  }
  return names;
}

/// Adds a column per component: "base_x".
void AddColumns(const std::string& name, std::initializer_list<const char*> components,
                std::vector<std::string>* columns) {
  for (const char* component : components) columns->push_back(name + "_" + component);
}

std::vector<std::string> CsvColumns(const std::vector<std::string>& joints, const std::set<std::string>& contacts) {
  std::vector<std::string> columns = {"time_s", "waypoint"};
  AddColumns("base", {"x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"}, &columns);
  for (const char* quantity : {"position", "velocity", "acceleration", "torque"}) {
    for (const std::string& joint : joints) columns.push_back(std::string(quantity) + "_" + joint);
  }
  for (const std::string& contact : contacts) {
    AddColumns("force_" + contact, {"x", "y", "z"}, &columns);
    AddColumns("moment_" + contact, {"x", "y", "z"}, &columns);
  }
  columns.emplace_back("imbalance");
  return columns;
}

/// Sum of a contact's forces, and their moment about the origin of the world.
struct ContactWrench {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero(), moment_Nm = Eigen::Vector3d::Zero();
};

std::vector<nlohmann::json> CsvRow(const MotionSample& sample, const std::set<std::string>& contacts) {
  std::vector<nlohmann::json> row = {sample.time_s, sample.parameter};
  const auto add = [&](const auto& values) {
    for (const double value : values) row.emplace_back(Unsigned0(value));
  };
  const auto configuration = PartsOf(sample.x);
  const auto velocity = TangentPartsOf(sample.velocity);
  add(configuration.base_position());
  add(configuration.quaternion_coefficients());
  add(velocity.base_position());
  add(velocity.base_rotation());
  add(configuration.joints());
  add(velocity.joints());
  add(TangentPartsOf(sample.acceleration).joints());
  add(sample.torques);
  std::map<std::string, ContactWrench> wrenches;
  for (const ContactForce& force : sample.forces) {
    wrenches[force.contact].force_N += force.force_N;
    wrenches[force.contact].moment_Nm += force.position_W.cross(force.force_N);
  }
  for (const std::string& contact : contacts) {
    add(wrenches[contact].force_N);
    add(wrenches[contact].moment_Nm);
  }
  row.emplace_back(sample.imbalance);
  return row;
}

std::string FormatCsv(const Dataset& dataset, const SampledMotion& motion) {
  const std::set<std::string> contacts = ContactsOf(motion);
  Listing listing;
  listing.columns = CsvColumns(DofNames(dataset.robot()), contacts);
  for (const MotionSample& sample : motion.samples) listing.rows.push_back(CsvRow(sample, contacts));
  return RenderListing(listing, TableFormat::kCsv);
}

Json SampleJson(const MotionSample& sample) {
  const auto configuration = PartsOf(sample.x);
  const auto velocity = TangentPartsOf(sample.velocity), acceleration = TangentPartsOf(sample.acceleration);
  Json forces = Json::object();
  for (const ContactForce& force : sample.forces) {
    forces[force.contact].push_back({{"at_m", NumbersOf(force.position_W)}, {"force_N", NumbersOf(force.force_N)}});
  }
  return {{"time_s", sample.time_s},
          {"waypoint", sample.parameter},
          {"base_position_m", NumbersOf(configuration.base_position())},
          {"base_quaternion_wxyz", NumbersOf(configuration.quaternion_coefficients())},
          {"base_velocity", NumbersOf(velocity.base_position())},
          {"base_angular_velocity", NumbersOf(velocity.base_rotation())},
          {"base_acceleration", NumbersOf(acceleration.base_position())},
          {"base_angular_acceleration", NumbersOf(acceleration.base_rotation())},
          {"positions", NumbersOf(configuration.joints())},
          {"velocities", NumbersOf(velocity.joints())},
          {"accelerations", NumbersOf(acceleration.joints())},
          {"torques", NumbersOf(sample.torques)},
          {"contacts", forces},
          {"imbalance", sample.imbalance}};
}

/// Joints that follow another one, which are no degrees of freedom.
Json FollowersJson(const RobotModel& robot) {
  Json followers = Json::array();
  for (const Joint& joint : robot.joints()) {
    if (joint.leader < 0) continue;
    followers.push_back({{"joint", joint.name},
                         {"leader", robot.joints()[static_cast<size_t>(joint.leader)].name},
                         {"multiplier", joint.multiplier},
                         {"offset", joint.offset}});
  }
  return followers;
}

std::string FormatJson(const Dataset& dataset, const MotionOrigin& origin, const SampledMotion& motion) {
  Json json = HeadOf("motion", dataset, origin, motion);
  json["joints"] = DofNames(dataset.robot());
  json["followers"] = FollowersJson(dataset.robot());
  json["velocity_limits"] = NumbersOf(dataset.robot().velocity_limits());
  json["effort_limits"] = NumbersOf(dataset.robot().effort_limits());
  json["samples"] = Json::array();
  for (const MotionSample& sample : motion.samples) json["samples"].push_back(SampleJson(sample));
  return Dump(json) + "\n";
}

Json PhaseContactJson(const Dataset& dataset, const ContactTarget& target) {
  const Contact& contact = dataset.contact(target.contact);
  Json json = {{"contact", target.contact},
               {"link", contact.link},
               {"kind", ToString(contact.kind)},
               {"position_m", NumbersOf(target.position)},
               {"quaternion_wxyz", QuaternionJson(target.rotation.normalized())},
               {"link_position_m", NumbersOf(contact.X_LC.translation())},
               {"link_quaternion_wxyz", QuaternionJson(Eigen::Quaterniond(contact.X_LC.linear()))},
               {"carries", target.carries}};
  if (!target.carries) return json;
  Stance alone;
  alone.contacts = {target};
  const TouchedSurface surface = SurfacesOf(dataset, alone).front();
  json["friction"] = surface.max_component ? Json() : Json(surface.friction);
  json["points_m"] = Json::array();
  for (const Eigen::Vector3d& point : surface.points_W) json["points_m"].push_back(NumbersOf(point));
  return json;
}

std::string FormatContacts(const Dataset& dataset, const MotionOrigin& origin, const SampledMotion& motion) {
  Json json = HeadOf("contact sequence", dataset, origin, motion);
  json["phases"] = Json::array();
  for (const MotionPhase& phase : motion.phases) {
    Json contacts = Json::array();
    for (const ContactTarget& target : phase.contacts.contacts) contacts.push_back(PhaseContactJson(dataset, target));
    json["phases"].push_back({{"begin_s", phase.begin_s}, {"end_s", phase.end_s}, {"contacts", contacts}});
  }
  return Dump(json, 1) + "\n";
}

}  // namespace

std::string FormatMotion(const Dataset& dataset, const MotionOrigin& origin, const SampledMotion& motion,
                         MotionFormat format) {
  switch (format) {
    case MotionFormat::kCsv:
      return FormatCsv(dataset, motion);
    case MotionFormat::kJson:
      return FormatJson(dataset, origin, motion);
    case MotionFormat::kContacts:
      return FormatContacts(dataset, origin, motion);
  }
  return "";
}

}  // namespace legopt::client
