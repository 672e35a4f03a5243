#include "legopt/worldgen/internal/contact_station.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "legopt/math/random_numbers.h"
#include "legopt/problem/terms/internal/arm_guess.h"
#include "legopt/robot/configuration.h"

namespace legopt::worldgen {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;

double Between(double low, double high, std::mt19937_64& generator) {
  return low + (high - low) * UniformRandom(generator);
}

/// A range per level, from which a value is drawn.
struct Ranges {
  std::array<std::pair<double, double>, 3> of_level;

  double Draw(ContactLevel level, std::mt19937_64& generator) const {
    const auto& [low, high] = of_level[static_cast<std::size_t>(level)];
    return Between(low, high, generator);
  }
};

constexpr Ranges kSlope_deg = {{{{30.0, 34.0}, {34.0, 38.0}, {38.0, 43.0}}}};     // slide
constexpr Ranges kBeyond_m = {{{{0.02, 0.06}, {0.06, 0.12}, {0.12, 0.18}}}};      // reach: further than the bound
constexpr Ranges kStep = {{{{0.40, 0.46}, {0.46, 0.53}, {0.53, 0.62}}}};          // climb: share of the trunk's height
constexpr Ranges kFragment_deg = {{{{15.0, 30.0}, {25.0, 40.0}, {35.0, 50.0}}}};  // rubble: steepest fragment

/// Returns the frame of a plane through the origin that descends by `slope_rad` towards `downhill_rad`, with the x axis
/// as near as possible to `heading_rad`.
Isometry3d Slope(double slope_rad, double downhill_rad, double heading_rad) {
  const Vector3d normal =
      AngleAxisd(downhill_rad, Vector3d::UnitZ()) * (AngleAxisd(slope_rad, Vector3d::UnitY()) * Vector3d::UnitZ());
  const Vector3d heading(std::cos(heading_rad), std::sin(heading_rad), 0.0);
  Isometry3d frame = Isometry3d::Identity();
  const Vector3d y = normal.cross(heading).normalized();
  frame.linear() << y.cross(normal), y, normal;
  return frame;
}

/// Returns the point of a plane above or below a horizontal position.
Vector3d OnPlane(const Isometry3d& plane, const Eigen::Vector2d& at) {
  const Vector3d normal = plane.linear().col(2);
  const Vector3d& origin = plane.translation();
  return {at.x(), at.y(), origin.z() - normal.head<2>().dot(at - origin.head<2>()) / normal.z()};
}

constexpr double kFragmentThickness = 0.15;  // share of the trunk's height

/// Returns true for contacts that stations have something to touch for: walls for patches, and bars.
bool IsHand(const Contact& contact) {
  const ContactShape shape = contact.facts().shape;
  return !contact.facts().supports && (shape == ContactShape::kPatch || shape == ContactShape::kBar);
}

}  // namespace

StationDrawer::StationDrawer(std::shared_ptr<const Dataset> dataset, double fragment)
    : dataset_(std::move(dataset)),
      kinematics_(dataset_->robot()),
      nominal_(dataset_->self_collision_reference()),
      height_m_(dataset_->trunk_height_m()),
      fragment_m_(fragment * height_m_) {
  const RobotModel& robot = dataset_->robot();
  nominal_.head(robot.num_dofs()) = dataset_->nominal_joints();
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (const Contact& foot : dataset_->feet()) centre += foot.nominal_position_B.head<2>();
  centre /= static_cast<double>(dataset_->feet().size());
  MutablePartsOf(nominal_).base_position() << -centre, -dataset_->nominal_sole_height_m();
  for (const Contact& contact : dataset_->contacts()) {
    if (!IsHand(contact)) continue;
    const auto known = std::ranges::find_if(
        hands_, [&](const Hand& hand) { return hand.contacts.front()->link_index == contact.link_index; });
    Hand& hand = known != hands_.end() ? *known : hands_.emplace_back();
    hand.contacts.push_back(&contact);
    hand.dofs = ArmDofs(*dataset_, contact);
  }
}

bool StationDrawer::Suits(ContactFamily family) const {
  if (family == ContactFamily::kRubble) return hands_.empty() && dataset_->feet().size() > 2;
  if (family != ContactFamily::kReach) return !hands_.empty();
  return std::ranges::any_of(hands_, [](const Hand& hand) {
    return std::ranges::any_of(hand.contacts, [](const Contact* c) { return c->kind == ContactKind::kPalm; });
  });
}

void StationDrawer::AddContact(const Contact& contact, const Frame& frame, Station* station) {
  ContactTarget target{.contact = contact.name,
                       .position = frame.translation(),
                       .rotation = Eigen::Quaterniond(frame.linear()).normalized()};
  if (contact.facts().forces == ContactForces::kFrictionCones) target.friction = kFriction;
  station->stance.contacts.push_back(std::move(target));
}

void StationDrawer::AddSlab(const std::string& name, const Frame& top, const Vector3d& size, Station* station) {
  SceneObject slab;
  slab.name = name;
  slab.shape.kind = ShapeSpec::Kind::kBox;
  slab.shape.size = size;
  slab.shape.pose = top * Eigen::Translation3d(0.0, 0.0, -0.5 * size.z());
  station->objects.push_back(std::move(slab));
}

void StationDrawer::AddTouched(const Contact& contact, const Frame& frame, const std::string& suffix,
                               Station* station) {
  if (contact.facts().shape == ContactShape::kPatch) {
    constexpr double kWall_m = 0.3, kThickness_m = 0.08;
    AddSlab("wall-" + contact.name + suffix, frame, {kWall_m, kWall_m, kThickness_m}, station);
    return;
  }
  constexpr double kBar_m = 0.5;
  SceneObject bar;
  bar.name = "bar-" + contact.name + suffix;
  bar.shape.kind = ShapeSpec::Kind::kCapsule;
  bar.shape.size = {contact.radius_m, 0.0, kBar_m};
  bar.shape.pose = frame * AngleAxisd(0.5 * std::numbers::pi, Vector3d::UnitY());
  station->objects.push_back(std::move(bar));
}

std::optional<StationDrawer::Frame> StationDrawer::DrawHand(const Contact& contact, std::mt19937_64& generator) {
  const RobotModel& robot = dataset_->robot();
  const auto hand =
      std::ranges::find_if(hands_, [&](const Hand& h) { return h.contacts.front()->link_index == contact.link_index; });
  constexpr int kTries = 50;
  for (int trial = 0; trial < kTries; ++trial) {
    Eigen::VectorXd x = nominal_;
    for (const int dof : hand->dofs) {
      constexpr double kInner = 0.8;  // share of the joints' ranges
      const double low = std::max(robot.lower_limits()[dof], -std::numbers::pi);
      const double high = std::min(robot.upper_limits()[dof], std::numbers::pi);
      x[dof] = 0.5 * (low + high) + kInner * (Between(low, high, generator) - 0.5 * (low + high));
    }
    kinematics_.UpdatePoses(x);
    const Frame frame = kinematics_.link_pose(contact.link_index) * contact.X_LC;
    const Vector3d& p = frame.translation();
    const bool in_front = p.x() > 0.2 * height_m_;
    const bool at_height = p.z() > 0.6 * height_m_ && p.z() < 2.0 * height_m_;
    // A palm faces away from the robot: the normal of what it touches points to the robot.
    const bool faces = contact.facts().shape != ContactShape::kPatch || frame.linear()(0, 2) < -0.3;
    if (in_front && at_height && faces) return frame;
  }
  return std::nullopt;
}

void StationDrawer::AddHands(int count, bool bars_only, std::mt19937_64& generator, Station* station) {
  std::vector<const Hand*> hands;
  for (const Hand& hand : hands_) hands.push_back(&hand);
  if (count < std::ssize(hands) && UniformRandom(generator) < 0.5) std::ranges::reverse(hands);
  for (const Hand* hand : hands) {
    if (count-- <= 0) return;
    std::vector<const Contact*> choice;
    for (const Contact* contact : hand->contacts) {
      if (!bars_only || contact->facts().shape == ContactShape::kBar) choice.push_back(contact);
    }
    if (choice.empty()) choice = hand->contacts;
    const auto index = static_cast<std::size_t>(UniformRandom(generator) * static_cast<double>(choice.size()));
    const std::optional<Frame> frame = DrawHand(*choice[index], generator);
    if (!frame) continue;
    AddContact(*choice[index], *frame, station);
    AddTouched(*choice[index], *frame, "", station);
  }
}

void StationDrawer::DrawSlide(ContactLevel level, std::mt19937_64& generator, Station* station) {
  const double slope_rad = kSlope_deg.Draw(level, generator) * kDegree;
  const Isometry3d plane = Slope(slope_rad, 2.0 * std::numbers::pi * UniformRandom(generator), 0.0);
  constexpr double kSlab_m = 0.9, kThickness_m = 0.1, kPlace_m = 0.05, kTurn_rad = 0.25;
  AddSlab("slope", plane, {kSlab_m, kSlab_m, kThickness_m}, station);
  for (const Contact& foot : dataset_->feet()) {
    const Vector3d nominal = foot.nominal_position_B + PartsOf(nominal_).base_position();
    const Eigen::Vector2d at = nominal.head<2>() + Eigen::Vector2d(Between(-kPlace_m, kPlace_m, generator),
                                                                   Between(-kPlace_m, kPlace_m, generator));
    Isometry3d frame = plane * AngleAxisd(Between(-kTurn_rad, kTurn_rad, generator), Vector3d::UnitZ());
    frame.translation() = OnPlane(plane, at);
    AddContact(foot, frame, station);
  }
  AddHands(level == ContactLevel::kHard ? 1 : 2, false, generator, station);
  if (level != ContactLevel::kHard) return;
  std::vector<ContactTarget>& contacts = station->stance.contacts;
  const auto slippery = static_cast<std::size_t>(UniformRandom(generator) * static_cast<double>(contacts.size()));
  if (contacts[slippery].friction) contacts[slippery].friction = kLowFriction;
}

void StationDrawer::DrawReach(ContactLevel level, std::mt19937_64& generator, Station* station) {
  constexpr double kGround_m = 0.9, kThickness_m = 0.1, kTable_m = 0.4;
  AddSlab("ground", Isometry3d::Identity(), {kGround_m, kGround_m, kThickness_m}, station);
  double front_m = 0.0;
  for (const Contact& foot : dataset_->feet()) {
    Isometry3d frame = Isometry3d::Identity();
    frame.translation().head<2>() = (foot.nominal_position_B + PartsOf(nominal_).base_position()).head<2>();
    AddContact(foot, frame, station);
    front_m = std::max(front_m, frame.translation().x() + foot.Patch().max().x());
  }
  const double beyond_m = kBeyond_m.Draw(level, generator);
  const double table_m = Between(0.55, 0.8, generator) * height_m_;
  const double tilt_rad = Between(10.0, 35.0, generator) * kDegree;
  for (const Hand& hand : hands_) {
    const auto palm =
        std::ranges::find_if(hand.contacts, [](const Contact* c) { return c->kind == ContactKind::kPalm; });
    if (palm == hand.contacts.end()) continue;
    // Descends towards the robot, so that it can be pushed.
    Isometry3d frame = Slope(tilt_rad, std::numbers::pi, 0.0);
    const double side = (*palm)->nominal_position_B.y() > 0.0 ? 1.0 : -1.0;
    const double reach_m = (*palm)->com_reach_m;
    frame.translation() << front_m + reach_m + beyond_m, side * Between(0.15, 0.3, generator) * height_m_, table_m;
    AddContact(**palm, frame, station);
    AddSlab("table-" + (*palm)->name, frame, {kTable_m, kTable_m, kThickness_m}, station);
  }
}

void StationDrawer::DrawClimb(ContactLevel level, std::mt19937_64& generator, Station* station) {
  constexpr double kSide_m = 0.6, kThickness_m = 0.1;
  const double height_m = kStep.Draw(level, generator) * height_m_;
  const double ahead_m = Between(0.25, 0.4, generator) * height_m_;
  bool first = UniformRandom(generator) < 0.5;
  for (const Contact& foot : dataset_->feet()) {
    Isometry3d frame = Isometry3d::Identity();
    frame.translation().head<2>() = (foot.nominal_position_B + PartsOf(nominal_).base_position()).head<2>();
    const std::string name = first ? "step-" : "ground-";
    if (first) frame.translation() += Vector3d(ahead_m, 0.0, height_m);
    first = !first;
    AddContact(foot, frame, station);
    Isometry3d top = frame;
    top.translation().y() *= 2.0;  // away from the other leg
    AddSlab(name + foot.name, top, {0.5 * kSide_m, kSide_m, kThickness_m}, station);
  }
  AddHands(level == ContactLevel::kHard ? 1 : 2, true, generator, station);
  for (std::size_t i = dataset_->feet().size(); i < station->stance.contacts.size(); ++i) {  // higher, with the robot
    const Vector3d up(0.5 * ahead_m, 0.0, 0.5 * height_m);
    station->stance.contacts[i].position += up;
    station->objects[i].shape.pose.pretranslate(up);
  }
}

StationDrawer::Frame StationDrawer::DrawFragment(const Vector3d& near_position, double spread, double steepest_rad,
                                                 std::mt19937_64& generator) const {
  constexpr double kLeastShare = 0.5, kHeight = 0.15;
  Isometry3d frame = Slope(steepest_rad * (kLeastShare + (1.0 - kLeastShare) * UniformRandom(generator)),
                           2.0 * std::numbers::pi * UniformRandom(generator), 0.0);
  frame.translation() << near_position.x() + Between(-spread, spread, generator) * height_m_,
      near_position.y() + Between(-spread, spread, generator) * height_m_,
      Between(-kHeight, kHeight, generator) * height_m_;
  return frame;
}

void StationDrawer::DrawRubble(ContactLevel level, std::mt19937_64& generator, Station* station) {
  const std::vector<Contact>& feet = dataset_->feet();
  const bool lifts = level != ContactLevel::kEasy && feet.size() > 3 && UniformRandom(generator) < 0.4;
  const auto lifted = static_cast<std::size_t>(UniformRandom(generator) * static_cast<double>(feet.size()));
  const double steepest_rad = kFragment_deg.Draw(level, generator) * kDegree;
  for (std::size_t k = 0; k < feet.size(); ++k) {
    if (lifts && k == lifted) continue;
    const Vector3d nominal = feet[k].nominal_position_B + PartsOf(nominal_).base_position();
    const Isometry3d frame = DrawFragment(nominal, 0.2, steepest_rad, generator);
    AddContact(feet[k], frame, station);
    AddSlab("fragment-" + feet[k].name, frame, {fragment_m_, fragment_m_, kFragmentThickness * height_m_}, station);
  }
}

Station StationDrawer::Draw(ContactFamily family, ContactLevel level, std::mt19937_64& generator) {
  Station station{.family = family, .level = level, .objects = {}, .stance = {}};
  switch (family) {
    case ContactFamily::kSlide:
      DrawSlide(level, generator, &station);
      break;
    case ContactFamily::kReach:
      DrawReach(level, generator, &station);
      break;
    case ContactFamily::kClimb:
      DrawClimb(level, generator, &station);
      break;
    case ContactFamily::kRubble:
      DrawRubble(level, generator, &station);
      break;
  }
  return station;
}

ContactTarget StationDrawer::Continue(const ContactTarget& target, const Vector3d& shift, const std::string& suffix,
                                      std::mt19937_64& generator, Station* station) {
  constexpr double kSlab_m = 0.45, kThickness_m = 0.1, kSpread = 0.03;
  const Contact& contact = dataset_->contact(target.contact);
  Isometry3d frame = Isometry3d::Identity();
  frame.linear() = target.rotation.normalized().toRotationMatrix();
  frame.translation() = target.position + shift;
  const Vector3d normal = frame.linear().col(2);
  if (station->family == ContactFamily::kRubble) {
    frame = DrawFragment(frame.translation(), kSpread, std::acos(std::clamp(normal.z(), -1.0, 1.0)), generator);
    AddSlab("fragment-" + contact.name + "-" + suffix, frame,
            {fragment_m_, fragment_m_, kFragmentThickness * height_m_}, station);
  } else {
    if (contact.facts().shape != ContactShape::kBar) frame.translation() -= normal.dot(shift) * normal;
    if (IsHand(contact)) {
      AddTouched(contact, frame, "-" + suffix, station);
    } else {
      AddSlab("slab-" + contact.name + "-" + suffix, frame, {kSlab_m, kSlab_m, kThickness_m}, station);
    }
  }
  ContactTarget moved = target;
  moved.position = frame.translation();
  moved.rotation = Eigen::Quaterniond(frame.linear()).normalized();
  return moved;
}

}  // namespace legopt::worldgen
