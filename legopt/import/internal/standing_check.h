#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/import/internal/dataset_diagnostic.h"
#include "legopt/import/internal/standing_proof.h"
#include "legopt/import/internal/standing_view.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// Steps of the check of a standing robot.
struct StandingOptions {
  bool search_posture = true;  ///< search a nominal posture (nominal_posture.h)
  bool prove = true;           ///< prove that the robot stands (standing_proof.h)
};

/// The robot on level ground.
struct StandingRobot {
  StandingProof proof;
  StandingView view;  ///< picture of the posture at the end of the proof
};

/// Completes the description of an imported robot with a nominal posture, and proves that the robot stands on level
/// ground and on a slope of 10 degrees.
///
/// If collisions keep it from standing on the level, and the description lists sampled link pairs, the pairs that
/// overlap at the end of the solve and have at most three moving joints between them are listed as
/// UncheckedReason::kStanding, and the proof is repeated, up to five times. Reports everything in `findings`: a robot
/// that cannot stand on the level with severity error, one that cannot on the slope with a warning.
///
/// `folder`: holds the robot of `description`. Both it and `findings` must outlive the object. Returns nothing without
/// a proof. Throws InputError like Dataset::Load.
class StandingCheck {
 public:
  StandingCheck(const StandingOptions& options, std::filesystem::path folder, ReadGuard guard,
                DatasetDescription* description, std::vector<DatasetDiagnostic>* findings);

  /// `guess`: a posture in which the robot may stand (n + 7, base upright).
  std::optional<StandingRobot> Run(const RobotModel& robot, const Eigen::VectorXd& guess);

 private:
  void NoteNominal(const RobotModel& robot, const std::optional<Eigen::VectorXd>& nominal);
  void NoteProof(const StandingProof& proof, bool on_ramp);
  void Exclude(const std::vector<LinkPair>& pairs, const RobotModel& robot);
  void NotePairs(const std::vector<LinkPair>& pairs, const RobotModel& robot);
  void Note(DatasetDiagnostic::Severity severity, const std::string& check, const std::string& field,
            const std::string& value, const std::string& message, const std::string& fix = "");

  StandingOptions options_;
  std::filesystem::path folder_;
  ReadGuard guard_;
  DatasetDescription& description_;
  std::vector<DatasetDiagnostic>& findings_;
};

}  // namespace legopt
