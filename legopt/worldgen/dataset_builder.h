#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "legopt/worldgen/internal/histogram.h"
#include "legopt/worldgen/internal/pair_planner.h"
#include "legopt/worldgen/internal/scenario.h"
#include "legopt/worldgen/internal/stance_sampler.h"

namespace legopt::worldgen {

/// Name of the file, in the dataset's folder, with the stances at which plans start and end.
inline constexpr const char* kStancesFileName = "stances.json";

/// Options of a new dataset: sources of robot and scene, and numbers of problems.
struct DatasetOptions {
  std::string name;                         ///< name of the dataset; letters, digits, '-', '_'
  std::filesystem::path robot_folder;       ///< folder of the dataset that provides robot and constants
  std::optional<ScenarioOptions> scenario;  ///< generated scene; default: the scene of `robot_folder`
  bool pictures = true;                     ///< if true, writes a PNG of the scene for each camera
  std::uint64_t seed = 1;                   ///< seed of all random numbers
  int stances = 100;                        ///< number of stances, the end points of plans and candidates for postures
  int same_floor = 25;                      ///< number of motion problems on one floor
  /// Number of motion problems that end on another floor. Default: kDifferentFloors, or as many more on one floor if no
  /// two stances are on different floors.
  std::optional<int> different_floors;
  static constexpr int kDifferentFloors = 25;
  int postures = 50;                ///< number of posture problems
  int threads = 1;                  ///< number of threads; does not affect the result
  std::optional<double> radius_m;   ///< maximum distance of the feet; default: see ProbeFor
  std::optional<double> slope_rad;  ///< maximum slope of a surface; default: see ProbeFor
  /// Requires that every stance of a motion problem has a posture, and writes a certificate (certificate.h).
  bool certified = false;
  /// File with stances that have a posture (proven_stances.h), used instead of sampling and proving `stances` of them.
  std::optional<std::filesystem::path> proven;
  ReadGuard read_guard;  ///< runs the parsers of robot and meshes; does not affect the result

  /// Text of all options that affect the result. Throws InputError if `proven` cannot be read.
  std::string Identity() const;
  /// Text of the options that affect scene and stances. If it is equal, work in a folder can be resumed with other
  /// numbers of plans; the result is that of a run from scratch.
  std::string StanceOptionsText() const;
  /// Returns the criteria for contacts of the robot of `dataset`.
  ProbeOptions ProbeFor(const Dataset& dataset) const;
  /// Throws InputError with the command-line flag that is out of range.
  void Validate() const;
};

/// Summary of a generated dataset, for the user.
struct DatasetReport {
  std::string content_hash;
  std::string tally;                     ///< statistics of stance sampling
  int pairs_tried = 0;                   ///< number of planner runs, successful or not
  int largest_motion = 0;                ///< largest number of stances of a motion
  bool one_floor = false;                ///< no two stances are on different floors, and no such motion was asked for
  std::vector<HistogramRow> histograms;  ///< histograms of the paper's two figures
};

/// Progress callback with stage, done, total and unit. Called from one thread at a time; may be empty.
using BuildProgress = std::function<void(const std::string&, double, double, const std::string&)>;

/// Generates a complete dataset in `folder`, which must exist: scene, robot, stances, footstep plans, motion problems
/// on one floor and between floors, posture problems by K-means over (stance length, stance height, trunk distance),
/// and a proof of each of them.
///
/// Files: those of a dataset (dataset_file.h); scenario.json, building.csv and pictures for a generated scene;
/// generation.json (generation_record.h); certificate.json if requested; stances.json, plans.csv, features.csv,
/// histograms.txt and .svg; solutions-posture.json (accepted by the judge's literal and strict rules: the original
/// evaluator's rule, and every listed pair). Stages that `folder` already contains from an interrupted run with the
/// same options are not repeated. The result depends on the options only, not on the number of threads. Throws
/// InputError: see the parts; a scene mesh with holes or inverted winding; a robot without two feet.
DatasetReport BuildDataset(const DatasetOptions& options, const std::filesystem::path& folder,
                           const BuildProgress& progress);

/// Generates a dataset in `folder`, which must exist, with `stances` geometrically valid posture problems of unknown
/// feasibility and no motions. Solving these problems as jobs checks feasibility; the solutions are the input `proven`
/// of another BuildDataset. The options for plans and postures are ignored. Throws like BuildDataset.
DatasetReport BuildCandidates(const DatasetOptions& options, const std::filesystem::path& folder,
                              const BuildProgress& progress);

}  // namespace legopt::worldgen
