#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "legopt/generate/histogram.h"
#include "legopt/generate/pair_planner.h"
#include "legopt/generate/scenario.h"
#include "legopt/generate/stance_sampler.h"

namespace legopt::generate {

/// Name of the file, in the dataset's folder, of the stances that plans start and end at.
inline constexpr const char* kStancesFileName = "stances.json";

/// A dataset to be made: where robot and scene come from, and how many problems.
struct DatasetOptions {
  std::string name;                         ///< of the dataset; letters, digits, '-', '_'
  std::filesystem::path robot_folder;       ///< a dataset: its robot and constants
  std::optional<ScenarioOptions> scenario;  ///< generated scene; without it the scene of `robot_folder`
  bool pictures = true;                     ///< a PNG of the scene for each camera, too
  std::uint64_t seed = 1;                   ///< of every draw
  int stances = 100;                        ///< wanted, to plan between and to choose postures from
  int same_floor = 25;                      ///< motion problems
  int different_floors = 25;                ///< likewise: those that end on another floor
  int postures = 50;                        ///< posture problems
  int threads = 1;                          ///< decides nothing
  std::optional<double> radius_m;           ///< largest distance of the feet
  std::optional<double> slope_rad;          ///< steepest surface; both default to those of the robot, see ProbeFor
  /// Motion problems are plans all of whose stances have a posture; a certificate says so (certificate.h).
  bool certified = false;
  /// Stances that have a posture (proven_stances.h), instead of sampling and proving `stances` of them.
  std::optional<std::filesystem::path> proven;
  ReadGuard read_guard;  ///< runs the readers of robot and meshes; decides nothing

  /// Everything that decides the result, as text. Throws InputError: `proven` cannot be read.
  std::string Identity() const;
  /// The part of it that decides scene and stances. Work may go on in a folder where it is equal: of the plans, whose
  /// number may differ, as many are taken as a run from nothing would have made.
  std::string StancesIdentity() const;
  /// What counts as a place to stand for the robot of `dataset`.
  ProbeOptions ProbeFor(const Dataset& dataset) const;
  /// Throws InputError naming the command-line flag that is out of range.
  void Validate() const;
};

/// What was made, for the user's eyes.
struct DatasetReport {
  std::string content_hash;              ///< of the dataset
  std::string tally;                     ///< of the stances
  int pairs_tried = 0;                   ///< planner's tries, successful or not
  int largest_motion = 0;                ///< stances
  std::vector<HistogramRow> histograms;  ///< the paper's two figures
};

/// stage, done, of all, unit; called from one thread at a time; may be empty.
using BuildProgress = std::function<void(const std::string&, double, double, const std::string&)>;

/// Makes a whole dataset in `folder`, which exists: scene, robot, stances, footstep plans, motion
/// problems on one floor and between floors, posture problems by K-means over (stance length, stance height, trunk
/// distance), and a proof for each of them.
///
/// Files: those of a dataset (dataset_file.h), scenario.json, building.csv and pictures for a generated scene,
/// generation.json (generation_record.h), certificate.json where asked for, stances.json, plans.csv, features.csv,
/// histograms.txt and .svg, solutions-posture.json (accepted by the judge, literally and strictly). Stages that
/// `folder` already holds from an interrupted run of the same options are not done again. The result depends on the
/// options only, whatever the number of threads. Throws InputError: see the parts; a scene mesh with holes or inverted
/// winding; a robot without two feet.
DatasetReport BuildDataset(const DatasetOptions& options, const std::filesystem::path& folder,
                           const BuildProgress& progress);

/// Makes a dataset in `folder`, which exists, whose posture problems are `stances` stances that geometry allows and
/// whose feasibility nobody has checked yet; no motions. Solving its problems as jobs is that check; what they prove is
/// `proven` of another BuildDataset. Of the options, plans and postures are not used. Throws as BuildDataset does.
DatasetReport BuildCandidates(const DatasetOptions& options, const std::filesystem::path& folder,
                              const BuildProgress& progress);

}  // namespace legopt::generate
