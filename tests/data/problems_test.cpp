// Policy: the embedded problems are well posed. Every contact patch lies entirely on one plane face of one piece and
// does not enter any other piece. The stances are within the ranges of the LegOpt posture problems, and motions walk
// with moderate steps. Whether a solver finds a posture or a motion is not tested here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "tests/data/embedded_dataset.h"

namespace legopt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kOnSurface_m = 1e-5;
constexpr double kSupport_m = 1e-3;

/// A face of a box: the axes of the face in the world, if `point` lies on it and its outward normal is `normal`.
struct Face {
  Eigen::Isometry3d pose;       ///< z = outward normal, origin at the face's centre
  Eigen::Vector2d half_size_m;  ///< along x and y
};

std::optional<Face> FaceUnder(const SceneObject& object, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  if (object.shape.kind != ShapeSpec::Kind::kBox) return std::nullopt;
  const Eigen::Isometry3d& pose = object.shape.pose;
  const Eigen::Vector3d local = pose.inverse() * point;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = pose.linear().col(axis).dot(normal);
    if (std::abs(along) < 1 - 1e-9) continue;
    const double half = object.shape.size[axis] / 2;
    const double sign = along > 0 ? 1.0 : -1.0;
    if (std::abs(sign * local[axis] - half) > kOnSurface_m) return std::nullopt;
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    Face face{.pose = Eigen::Isometry3d::Identity(),
              .half_size_m = {object.shape.size[u] / 2, object.shape.size[v] / 2}};
    face.pose.linear() << pose.linear().col(u), pose.linear().col(v) * sign, pose.linear().col(axis) * sign;
    face.pose.translation() = pose.translation() + sign * half * pose.linear().col(axis);
    return face;
  }
  return std::nullopt;
}

bool CarriesWholeSole(const Dataset& dataset, const ContactTarget& target, const Face& face) {
  const Eigen::AlignedBox3d& box = dataset.contact(target.contact).box_L;
  for (const double x : {box.min().x(), box.max().x()}) {
    for (const double y : {box.min().y(), box.max().y()}) {
      const Eigen::Vector3d corner =
          face.pose.inverse() * (target.position + target.rotation * Eigen::Vector3d(x, y, 0));
      const bool inside = std::abs(corner.x()) <= face.half_size_m.x() && std::abs(corner.y()) <= face.half_size_m.y();
      if (!inside || std::abs(corner.z()) > kSupport_m) return false;
    }
  }
  return true;
}

/// Every contact of both tasks, with its place in the files.
struct Standing {
  std::string where;
  ContactTarget target;
};

std::vector<Standing> AllTargets(const Dataset& dataset) {
  std::vector<Standing> all;
  for (const Task task : {Task::kPosture, Task::kMotion}) {
    for (const ProblemDefinition& problem : dataset.problems(task)) {
      for (const Stance& stance : problem.stances) {
        for (const ContactTarget& target : stance.contacts) {
          all.push_back(
              {std::string(ToString(task)) + " problem " + std::to_string(problem.id) + ", " + target.contact, target});
        }
      }
    }
  }
  return all;
}

TEST(EmbeddedProblems, LoadWithMatchingHashes) {
  ASSERT_NO_THROW(EmbeddedDataset());
  EXPECT_EQ(EmbeddedDataset()->name(), "garage-small");
  EXPECT_EQ(EmbeddedDataset()->content_hash().size(), 64u);
  EXPECT_GE(EmbeddedDataset()->problems(Task::kPosture).size(), 20u);
}

TEST(EmbeddedProblems, AreDifferentStancesWithIdsInOrder) {
  std::set<std::string> texts;
  int expected = 0;
  for (const ProblemDefinition& problem : EmbeddedDataset()->problems(Task::kPosture)) {
    EXPECT_EQ(problem.id, expected++);
    ASSERT_EQ(problem.stances.size(), 1u) << "problem " << problem.id;
    texts.insert(FormatStance(problem.stances[0]));
  }
  EXPECT_EQ(texts.size(), EmbeddedDataset()->problems(Task::kPosture).size());
}

TEST(EmbeddedProblems, StayWithinTheRangesOfTheBenchmark) {
  int double_supports = 0;
  for (const ProblemDefinition& problem : EmbeddedDataset()->problems(Task::kPosture)) {
    const std::vector<ContactTarget>& feet = problem.stances[0].contacts;
    for (const ContactTarget& foot : feet) {
      const double up = (foot.rotation * Eigen::Vector3d::UnitZ()).z();
      EXPECT_LE(std::acos(std::min(1.0, up)), 25 * kPi / 180) << "problem " << problem.id;
    }
    if (feet.size() != 2) continue;
    ++double_supports;
    EXPECT_EQ(feet[0].contact, "l_foot");
    EXPECT_EQ(feet[1].contact, "r_foot");
    const Eigen::Vector3d step = feet[1].position - feet[0].position;
    EXPECT_GE(step.head<2>().norm(), 0.24) << "problem " << problem.id;
    EXPECT_LE(step.head<2>().norm(), 0.68) << "problem " << problem.id;
    EXPECT_LE(std::abs(step.z()), 0.30) << "problem " << problem.id;
  }
  EXPECT_GE(double_supports, 20);
}

// Double, left, double, right, double, ...: while one foot is in contact the other one moves, and everything else
// stays.
TEST(EmbeddedProblems, MotionsWalkWithModerateSteps) {
  const auto& problems = EmbeddedDataset()->problems(Task::kMotion);
  EXPECT_GE(problems.size(), 3u);
  for (size_t id = 0; id < problems.size(); ++id) {
    const std::vector<Stance>& stances = problems[id].stances;
    EXPECT_EQ(problems[id].id, static_cast<int>(id));
    EXPECT_EQ(stances.size() % 2, 1u) << "problem " << id;
    EXPECT_GE(stances.size(), 5u);
    EXPECT_LE(stances.size(), 15u);
    for (size_t s = 0; s < stances.size(); ++s) {
      const std::vector<ContactTarget>& feet = stances[s].contacts;
      ASSERT_EQ(feet.size(), s % 2 == 0 ? 2u : 1u) << "problem " << id << ", stance " << s;
      EXPECT_EQ(feet[0].contact, s % 4 == 3 ? "r_foot" : "l_foot") << "problem " << id << ", stance " << s;
      if (s % 2 == 0) continue;
      const size_t standing = feet[0].contact == "l_foot" ? 0 : 1;
      const std::vector<ContactTarget>& before = stances[s - 1].contacts;
      const std::vector<ContactTarget>& after = stances[s + 1].contacts;
      EXPECT_EQ(before[standing].position, feet[0].position);
      EXPECT_EQ(after[standing].position, feet[0].position);
      const Eigen::Vector3d swing = after[1 - standing].position - before[1 - standing].position;
      EXPECT_GE(swing.norm(), 0.1) << "problem " << id << ", stance " << s;
      EXPECT_LE(swing.norm(), 0.5) << "problem " << id << ", stance " << s;
      const Eigen::Vector3d step = after[1].position - after[0].position;
      EXPECT_GE(step.head<2>().norm(), 0.24) << "problem " << id << ", stance " << s;
      EXPECT_LE(step.head<2>().norm(), 0.68) << "problem " << id << ", stance " << s;
    }
  }
}

TEST(EmbeddedProblems, EverySoleLiesWhollyOnOneFace) {
  const Dataset& dataset = *EmbeddedDataset();
  for (const auto& [where, target] : AllTargets(dataset)) {
    const Eigen::Vector3d normal = target.rotation * Eigen::Vector3d::UnitZ();
    const auto& objects = dataset.scene().objects;
    const bool carried = std::any_of(objects.begin(), objects.end(), [&, &sole = target](const SceneObject& object) {
      const std::optional<Face> face = FaceUnder(object, sole.position, normal);
      return face && CarriesWholeSole(dataset, sole, *face);
    });
    EXPECT_TRUE(carried) << where << " at " << target.position.transpose();
  }
}

TEST(EmbeddedProblems, NoFootEntersAnyPiece) {
  const Dataset& dataset = *EmbeddedDataset();
  for (const Contact& foot : dataset.contacts()) {
    const std::vector<ShapeSpec>& shapes = dataset.robot().links()[static_cast<size_t>(foot.link_index)].collision;
    ASSERT_EQ(shapes.size(), 1u) << foot.link << " is one box";
    Probe probe(shapes[0], dataset.scene());
    for (const auto& [where, target] : AllTargets(dataset)) {
      if (target.contact != foot.link) continue;
      const auto contacts = probe.Contacts(dataset.LinkTarget(target), 0.005);
      EXPECT_FALSE(contacts.empty()) << where << " hovers";
      for (const ProximityPair& contact : contacts) EXPECT_GT(contact.distance_m, 0.0) << where;
    }
  }
}

}  // namespace
}  // namespace legopt
