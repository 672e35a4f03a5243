#include "legopt/judge/path_examiner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "legopt/judge/diagnostic_text.h"
#include "legopt/judge/stance_measures.h"
#include "legopt/judge/violation.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/interpolation.h"

namespace legopt {

/// Segment between two consecutive waypoints.
struct PathExaminer::Segment {
  int waypoint = 0;  ///< index of the first of the two
  bool balanced = false;
  Stance planted;
};

PathExaminer::PathExaminer(const Dataset& dataset, ExactCollision& collision)
    : dataset_(&dataset), collision_(&collision), x_(dataset.robot().configuration_size()) {}

PathExamination PathExaminer::Examine(Task task, const ProblemDefinition& problem, const TimedPath& path) {
  PathExamination findings;
  findings.score = {.environment_depth_m = 0.0, .self_depth_m = 0.0, .free_share = 0.0};
  int free = 0;
  const int ways = static_cast<int>(path.waypoints.size()) - 1;
  for (int w = 0; w < ways; ++w) {
    const auto stance = [&](int waypoint) -> const Stance& {
      return problem.stances[static_cast<std::size_t>(StanceOfWaypoint(task, waypoint))];
    };
    ExamineSegment({.waypoint = w,
                    .balanced = DescriptionOf(task).between == TransitionRule::kBalanced,
                    .planted = PlantedContacts(stance(w), stance(w + 1))},
                   path, &findings);
    if (!segment_failed_) ++free;
  }
  findings.score.free_share = static_cast<double>(free) / ways;
  return findings;
}

void PathExaminer::ExamineSegment(const Segment& segment, const TimedPath& path, PathExamination* findings) {
  segment_failed_ = false;
  const std::size_t first = path.waypoints[static_cast<std::size_t>(segment.waypoint)];
  const std::size_t last = path.waypoints[static_cast<std::size_t>(segment.waypoint) + 1];
  for (std::size_t i = first; i < last; ++i) {
    from_ = ClampedConfiguration(dataset_->robot(), path.points[i]);
    to_ = ClampedConfiguration(dataset_->robot(), path.points[i + 1]);
    t_from_ = path.times[i];
    t_to_ = path.times[i + 1];
    turn_ = LargestTurn();
    ExaminePiece(segment, findings);
  }
}

void PathExaminer::ExaminePiece(const Segment& segment, PathExamination* findings) {
  Kinematics& at_from = Level(0);
  Kinematics& at_to = Level(1);
  at_from.Update(from_);
  at_to.Update(to_);
  const double length_m = collision_->LongestStep(at_from, at_to).distance_m;
  if (Exceeds(length_m, kLongestPiece_m) || Exceeds(turn_, kLargestPieceTurn)) {
    Fail(segment, 0.0, Verdict::kWrongSize,
         "a piece of " + LengthText(length_m) + " and " + NumberText(turn_) + " rad (at most " +
             LengthText(kLongestPiece_m) + " and " + NumberText(kLargestPieceTurn) + " rad)",
         findings);
    return;
  }
  ExamineSample(segment, 0.0, at_from, findings);
  Bisect(segment, 2, 0.0, at_from, 1.0, at_to, findings);
  ExamineSample(segment, 1.0, at_to, findings);
}

double PathExaminer::LargestTurn() const {
  const auto from = PartsOf(from_), to = PartsOf(to_);
  const double joints = from.num_joints() == 0 ? 0.0 : (to.joints() - from.joints()).cwiseAbs().maxCoeff();
  const double half = std::min(1.0, std::abs(from.quaternion_coefficients().dot(to.quaternion_coefficients())));
  return std::max(joints, 2.0 * std::acos(half));
}

Kinematics& PathExaminer::Level(std::size_t level) {
  while (levels_.size() <= level) levels_.emplace_back(dataset_->robot());
  return levels_[level];
}

/// Samples a piece recursively, in the order of time.
void PathExaminer::Bisect(const Segment& segment, std::size_t level, double s_from, const Kinematics& at_from,
                          double s_to, const Kinematics& at_to, PathExamination* findings) {
  const bool near =
      collision_->LongestStep(at_from, at_to).distance_m <= kPathSample_m && turn_ * (s_to - s_from) <= kPathSampleTurn;
  if (near) return;
  const double s = 0.5 * (s_from + s_to);
  Kinematics& middle = Level(level);
  InterpolateConfiguration(from_, to_, s, x_);
  middle.Update(x_);
  Bisect(segment, level + 1, s_from, at_from, s, middle, findings);
  ExamineSample(segment, s, middle, findings);
  Bisect(segment, level + 1, s, middle, s_to, at_to, findings);
}

void PathExaminer::Fail(const Segment& segment, double s, Verdict verdict, const std::string& detail,
                        PathExamination* findings) {
  segment_failed_ = true;
  if (findings->verdict != Verdict::kSuccess) return;
  findings->verdict = verdict;
  findings->waypoint = segment.waypoint;
  findings->detail =
      "on the segment to the next waypoint, at time " + NumberText(t_from_ + s * (t_to_ - t_from_)) + ": " + detail;
}

void PathExaminer::ExamineSample(const Segment& segment, double s, const Kinematics& kinematics,
                                 PathExamination* findings) {
  const auto include = [&](Verdict check, double value, const std::string& subject) {
    IncludeViolation(
        check, Rule::kLiteral, segment.waypoint, value, [&] { return subject; }, &findings->violations);
  };
  const std::vector<ContactPlacement> placements = ActualPlacements(*dataset_, segment.planted, kinematics);
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const ContactTarget& target = segment.planted.contacts[i];
    const ContactPoseError error =
        ComputeContactPoseError(placements[i].contact->LinkTarget(target), placements[i].X_WL);
    include(Verdict::kFootPose, error.violation, target.contact);
    if (!Exceeds(error.violation, kPlantedTolerance)) continue;
    Fail(segment, s, Verdict::kFootPose, "planted " + PoseErrorText(target.contact, error, kPlantedTolerance),
         findings);
  }
  if (segment.balanced) {
    const double distance = ComDistance(placements, kinematics);
    include(Verdict::kCom, std::max(0.0, distance), "centre of mass");
    if (Exceeds(distance, kPathComTolerance_m)) {
      Fail(segment, s, Verdict::kCom, ComErrorText(distance, kPathComTolerance_m), findings);
    }
  }
  const ExactCollision::SceneContact contact = collision_->DeepestEnvironmentContacts(kinematics).strict;
  findings->score.environment_depth_m = std::max(findings->score.environment_depth_m, contact.depth_m);
  const auto link_name = [&](int link) { return dataset_->robot().links()[static_cast<std::size_t>(link)].name; };
  if (Exceeds(contact.depth_m, kPathDepthTolerance_m)) {
    Fail(segment, s, Verdict::kEnvironmentCollision,
         link_name(contact.link) + " is " + LengthText(contact.depth_m) + " deep in '" +
             dataset_->scene().objects[static_cast<std::size_t>(contact.object)].name + "' of the scene",
         findings);
  }
  const ExactCollision::SelfDepths self = collision_->SelfDepth(kinematics);
  findings->score.self_depth_m = std::max(findings->score.self_depth_m, self.strict_m);
  if (Exceeds(self.strict_m, kPathDepthTolerance_m)) {
    Fail(segment, s, Verdict::kSelfCollision,
         link_name(self.strict_pair.first) + " and " + link_name(self.strict_pair.second) + " overlap by " +
             LengthText(self.strict_m),
         findings);
  }
}

}  // namespace legopt
