#include "legopt/import/contact_sequence.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

/// Largest difference of points that count as the same, m.
constexpr double kSamePoint_m = 1e-6;

SequenceContactType SequenceTypeOf(const Contact& contact) {
  if (contact.facts().forces == ContactForces::kBounded) return SequenceContactType::kUndefined;
  return contact.facts().shape == ContactShape::kBall ? SequenceContactType::kPoint : SequenceContactType::kPlanar;
}

/// Points where forces act, in the frame of the target.
std::vector<Eigen::Vector3d> SequencePointsOf(const Contact& contact) {
  if (contact.facts().shape == ContactShape::kBall) return {Eigen::Vector3d::Zero()};
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& point_L : contact.points_L) points.emplace_back(contact.X_LC.inverse() * point_L);
  return points;
}

SequencePatch PatchOf(const Contact& contact, const ContactTarget& target) {
  const bool has_friction = contact.facts().forces == ContactForces::kFrictionCones;
  return {.effector = contact.name,
          .position = target.position,
          .rotation = target.rotation.normalized().toRotationMatrix(),
          .friction = has_friction ? target.friction.value_or(contact.friction) : SequencePatch::kNoFriction,
          .type = SequenceTypeOf(contact),
          .points = SequencePointsOf(contact)};
}

SequencePhase PhaseOf(const Dataset& dataset, const Stance& stance) {
  SequencePhase phase;
  for (const ContactTarget& target : stance.contacts) {
    if (target.carries) phase.patches.push_back(PatchOf(dataset.contact(target.contact), target));
  }
  return phase;
}

/// Finds the contacts of effectors.
class ContactsByEffector {
 public:
  ContactsByEffector(const Dataset& dataset, const std::map<std::string, std::string>& effectors, std::string file)
      : dataset_(dataset), effectors_(effectors), file_(std::move(file)) {
    for (const auto& [effector, name] : effectors_) {
      if (FindByName(name) != nullptr) continue;
      throw InputError({.file = "",
                        .field = "--effectors",
                        .value = effector + "=" + name,
                        .message = "the dataset has no contact '" + name + "'",
                        .fix = SuggestName(name, Names())});
    }
  }

  const Contact& Of(const std::string& effector, const std::string& field) const {
    const auto named = effectors_.find(effector);
    if (const Contact* contact = FindByName(named == effectors_.end() ? effector : named->second)) return *contact;
    const std::vector<const Contact*> on_link = OnLink(effector);
    if (on_link.size() == 1) return *on_link.front();
    std::string names;
    for (const Contact* contact : on_link) names += (names.empty() ? "" : ", ") + contact->name;
    throw InputError(
        {.file = file_,
         .field = field,
         .value = effector,
         .message = on_link.empty() ? "the dataset has no contact, and no link or joint with a contact, of "
                                      "the effector's name"
                                    : "the link has several contacts: " + names,
         .fix = "name the contact with --effectors " + effector + "=CONTACT; " + SuggestName(effector, Names())});
  }

 private:
  const Contact* FindByName(const std::string& name) const {
    const auto found = std::ranges::find(dataset_.contacts(), name, &Contact::name);
    return found == dataset_.contacts().end() ? nullptr : &*found;
  }

  /// Returns the contacts on the link with a name, or on the link behind the joint with that name.
  std::vector<const Contact*> OnLink(const std::string& name) const {
    const RobotModel& robot = dataset_.robot();
    int link = robot.FindLink(name);
    const int joint = robot.FindJoint(name);
    if (link < 0 && joint >= 0) link = robot.joints()[static_cast<std::size_t>(joint)].child_link;
    std::vector<const Contact*> found;
    for (const Contact& contact : dataset_.contacts()) {
      if (link >= 0 && contact.link_index == link) found.push_back(&contact);
    }
    return found;
  }

  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const Contact& contact : dataset_.contacts()) names.push_back(contact.name);
    return names;
  }

  const Dataset& dataset_;
  const std::map<std::string, std::string>& effectors_;
  std::string file_;
};

/// Adds a warning once.
void Warn(const std::string& warning, std::vector<std::string>* warnings) {
  if (std::ranges::find(*warnings, warning) == warnings->end()) warnings->push_back(warning);
}

bool HaveSamePoints(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  return a.size() == b.size() && std::ranges::all_of(a, [&](const Eigen::Vector3d& point) {
           return std::ranges::any_of(
               b, [&](const Eigen::Vector3d& other) { return (point - other).cwiseAbs().maxCoeff() <= kSamePoint_m; });
         });
}

/// multicontact-api's default of a patch without points: one at the origin.
bool HasPoints(const SequencePatch& patch) {
  return patch.points.size() > 1 || (patch.points.size() == 1 && !patch.points.front().isZero(0.0));
}

void CompareModels(const SequencePatch& patch, const Contact& contact, std::vector<std::string>* warnings) {
  const std::string who = "effector " + patch.effector + ": ";
  const SequenceContactType expected = SequenceTypeOf(contact);
  if (patch.type != SequenceContactType::kUndefined && patch.type != expected) {
    Warn(who + "its type is " + std::string(ToString(patch.type)) + ", but contact '" + contact.name + "' is a " +
             std::string(ToString(contact.kind)) + "; the contact's kind is used",
         warnings);
  }
  if (HasPoints(patch) && !HaveSamePoints(patch.points, SequencePointsOf(contact))) {
    Warn(who + "its " + std::to_string(patch.points.size()) + " points differ from those of contact '" + contact.name +
             "', which are used",
         warnings);
  }
}

ContactTarget TargetOf(const SequencePatch& patch, const Contact& contact) {
  ContactTarget target{
      .contact = contact.name, .position = patch.position, .rotation = Eigen::Quaterniond(patch.rotation).normalized()};
  const bool has_friction = contact.facts().forces == ContactForces::kFrictionCones;
  if (has_friction && patch.friction != SequencePatch::kNoFriction && patch.friction != contact.friction) {
    target.friction = patch.friction;
  }
  return target;
}

/// Returns whether a stance of the dataset has exactly the patches of a phase.
bool Expresses(const Stance& stance, const SequencePhase& phase, const Dataset& dataset) {
  const auto known = [&](const ContactTarget& target) {
    return std::ranges::find(dataset.contacts(), target.contact, &Contact::name) != dataset.contacts().end();
  };
  return std::ranges::all_of(stance.contacts, known) && PhaseOf(dataset, stance).patches == phase.patches;
}

/// Appends the values of the joints below a link, depth first, siblings sorted by joint name.
void AppendJoints(const RobotModel& robot, const Eigen::VectorXd& x, int link, std::vector<double>* values) {
  std::vector<const Joint*> children;
  for (const Joint& joint : robot.joints()) {
    if (joint.parent_link == link) children.push_back(&joint);
  }
  std::ranges::sort(children, {}, &Joint::name);
  for (const Joint* joint : children) {
    if (joint->type != JointType::kFixed) {
      const double value = joint->leader < 0 ? x[joint->dof] : joint->multiplier * x[joint->dof] + joint->offset;
      if (joint->type == JointType::kContinuous) {
        values->insert(values->end(), {std::cos(value), std::sin(value)});
      } else {
        values->push_back(value);
      }
    }
    AppendJoints(robot, x, joint->child_link, values);
  }
}

}  // namespace

ImportedSequence StancesOf(const ContactSequence& sequence, const Dataset& dataset,
                           const std::map<std::string, std::string>& effectors, const std::string& file) {
  const ContactsByEffector contacts(dataset, effectors, file);
  ImportedSequence imported;
  for (std::size_t i = 0; i < sequence.phases.size(); ++i) {
    const SequencePhase& phase = sequence.phases[i];
    const std::string place = "phase " + std::to_string(i);
    if (!sequence.stances.empty() && Expresses(sequence.stances[i], phase, dataset)) {
      imported.stances.push_back(sequence.stances[i]);
      continue;
    }
    if (phase.patches.empty()) {
      throw InputError({.file = file,
                        .field = place,
                        .value = "",
                        .message = "has no effector in contact; a stance needs at least one contact",
                        .fix = "remove phases of flight"});
    }
    Stance stance;
    for (const SequencePatch& patch : phase.patches) {
      const Contact& contact = contacts.Of(patch.effector, place + ", effector_in_contact");
      if (std::ranges::find(stance.contacts, contact.name, &ContactTarget::contact) != stance.contacts.end()) {
        throw InputError({.file = file,
                          .field = place + ", effector_in_contact",
                          .value = patch.effector,
                          .message = "two effectors are contact '" + contact.name + "'",
                          .fix = "remove one, or name its contact with --effectors " + patch.effector + "=CONTACT"});
      }
      CompareModels(patch, contact, &imported.warnings);
      stance.contacts.push_back(TargetOf(patch, contact));
    }
    imported.stances.push_back(std::move(stance));
  }
  return imported;
}

ContactSequence SequenceOf(const Dataset& dataset, std::span<const Stance> stances,
                           std::span<const Eigen::VectorXd> waypoints) {
  ContactSequence sequence;
  sequence.stances.assign(stances.begin(), stances.end());
  const std::size_t each = stances.empty() ? 0 : waypoints.size() / stances.size();
  for (std::size_t i = 0; i < stances.size(); ++i) {
    SequencePhase phase = PhaseOf(dataset, stances[i]);
    if (each > 0) {
      phase.first = PinocchioConfiguration(dataset.robot(), waypoints[i * each]);
      phase.last = PinocchioConfiguration(dataset.robot(), waypoints[(i + 1) * each - 1]);
    }
    sequence.phases.push_back(std::move(phase));
  }
  return sequence;
}

Eigen::VectorXd PinocchioConfiguration(const RobotModel& robot, const Eigen::VectorXd& x) {
  const auto position = x.segment<3>(robot.base_position_index());
  const auto rotation = x.segment<4>(robot.base_rotation_index());  // w x y z
  std::vector<double> values(position.begin(), position.end());
  values.insert(values.end(), {rotation[1], rotation[2], rotation[3], rotation[0]});
  AppendJoints(robot, x, 0, &values);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), std::ssize(values));
}

}  // namespace legopt
