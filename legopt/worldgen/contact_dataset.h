#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "legopt/types/read_guard.h"
#include "legopt/worldgen/dataset_builder.h"
#include "legopt/worldgen/internal/histogram.h"

namespace legopt::worldgen {

/// Options of a dataset of stances, and of motions through them, that feet alone or level feet cannot hold.
struct ContactDatasetOptions {
  std::string name;                    ///< name of the dataset; letters, digits, '-', '_'
  std::filesystem::path robot_folder;  ///< folder of the dataset that provides robot, contacts and constants
  std::uint64_t seed = 1;              ///< seed of all random numbers
  int postures = 100;                  ///< number of postures, shared by the families that suit the robot
  int motions = 30;                    ///< number of motions, shared by the families that suit the robot
  int traps = 20;                      ///< number of certified infeasible problems
  int threads = 1;                     ///< number of threads; does not affect the result
  ReadGuard read_guard;                ///< runs the parsers of robot and meshes; does not affect the result

  /// Text of all options that affect the result.
  std::string Identity() const;
  /// Throws InputError with the command-line flag that is out of range.
  void Validate() const;
};

/// Summary of a generated dataset, for the user.
struct ContactDatasetReport {
  std::string content_hash;
  std::vector<std::string> lines;        ///< one per family and level: stations drawn, plausible, solved, chosen
  std::vector<HistogramRow> histograms;  ///< histograms of the six features
};

/// Generates a dataset of posture and motion problems in `folder`, which must exist. Every posture is a *station* of
/// its own, a few slabs and bars, apart from the next (contact_station.h), with a *planted* posture: one that
/// LegOpt-best found and that the judge accepts by the physical rule; from level intermediate on it resists a push of
/// 0.05 M g, which the problem then asks for. Families:
///
/// - slide: forces of the feet alone do not balance the weight, even with friction + 0.02 and the circumscribed
///   pyramid: proven for every posture (SlideProof). Hands on walls and bars do.
/// - reach: the feet's polygon is further from a hand than the centre of mass can be (Contact::com_reach_m): proven
/// likewise.
/// - climb: a foot on a high step, hands on bars.
/// - rubble: feet on fragments; for robots without hands and with more than two feet.
///
/// From three times as many planted stations as needed, K-means over six features chooses: number of contacts, largest
/// tilt, range of heights, area of the equilibrium polygon (logarithm), resisted push, distance of the trunk from the
/// scene.
///
/// A motion is a *course* over a station (contact_course.h): in turn each contact is lifted and placed again. It has a
/// planted motion, which LegOpt-best found without restarts and which the judge accepts as `balanced` by the physical
/// rule. The first courses that have one are taken, the same number of each level.
///
/// Files: those of a dataset (dataset_file.h), solutions-posture.json and solutions-motion.json (the planted ones),
/// certificate.json,
/// features.csv, histograms.txt and .svg, generation.json; and in `traps`, a dataset of stances that no forces hold,
/// with a proof of each in proofs.json. The result depends on the options only, not on the number of threads. Throws
/// InputError for a robot that suits no family, and if too few stations have a posture or too few courses a motion.
ContactDatasetReport BuildContactDataset(const ContactDatasetOptions& options, const std::filesystem::path& folder,
                                         const BuildProgress& progress);

}  // namespace legopt::worldgen
