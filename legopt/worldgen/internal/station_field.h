#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/judge/judge.h"
#include "legopt/planning/certify/internal/stance_certifier.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/statics/static_equilibrium.h"
#include "legopt/types/read_guard.h"
#include "legopt/worldgen/internal/contact_course.h"
#include "legopt/worldgen/internal/contact_station.h"

namespace legopt::worldgen {

/// Returns the place of station `index` of `count` on a square grid: 4 m apart, or 4.5 times the height of the robot's
/// trunk if that is more.
Eigen::Vector3d PlaceOfStation(const Dataset& robot, std::size_t index, std::size_t count);

/// The problems of a dataset, each at a place of its own: first the stations, then the courses.
struct StationField {
  std::vector<Station> stations;  ///< posture problem k is at station k
  std::vector<Course> courses;    ///< motion problem k is at course k

  std::size_t size() const { return stations.size() + courses.size(); }
};

/// Writes a dataset of a field: robot and constants are those of the dataset in `source`.
void WriteStations(const std::filesystem::path& source, const std::string& name, const std::string& comment,
                   const StationField& field, const std::filesystem::path& folder, const ReadGuard& guard);

/// A posture that the judge accepts by the physical rule.
struct PlantedPosture {
  bool accepted = false;
  Eigen::VectorXd x;                                     ///< n + 7 numbers
  double push_N = 0.0;                                   ///< push that the posture resists
  double trunk_distance_m = 0.0;                         ///< distance of the trunk from the scene, at most 1 m
  static constexpr const char* kMethod = "LegOpt-best";  ///< name of the method in solution files
};

/// A motion that the judge accepts as balanced, by the physical rule.
struct PlantedMotion {
  bool accepted = false;
  std::vector<Eigen::VectorXd> waypoints;  ///< n + 7 numbers each
};

/// Searches planted postures. First a few starts of a search without costs decide whether the stance has a posture at
/// all (StanceCertifier), which costs little where it has none; then LegOpt-best finds one under effort limits, from
/// the good initial guess with up to ten restarts. A workspace: one thread. The result depends on the stance and the
/// number of the problem only.
class PostureFinder {
 public:
  explicit PostureFinder(const std::shared_ptr<const Dataset>& dataset);
  /// Searches, judges and measures a posture.
  PlantedPosture Find(const ProblemDefinition& problem);
  /// Judges and measures a posture.
  PlantedPosture Measure(const ProblemDefinition& problem, const Eigen::VectorXd& x);
  /// Searches a motion through the stances of a problem: first a posture for each of them, then the motion by
  /// LegOpt-best without restarts.
  PlantedMotion FindMotion(const ProblemDefinition& problem);
  /// Judges a motion.
  bool Accepts(const ProblemDefinition& problem, const std::vector<Eigen::VectorXd>& waypoints);

 private:
  double TrunkDistance_m(const Kinematics& kinematics);

  std::shared_ptr<const Dataset> dataset_;
  ProblemSolver solver_;
  Judge judge_;
  certify::StanceCertifier certifier_;
  Method method_;
  Kinematics kinematics_;
  StaticEquilibrium equilibrium_;
  CollisionQuery query_;
};

}  // namespace legopt::worldgen
