#pragma once

#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/geometry/internal/pair_sampling.h"
#include "legopt/import/internal/dataset_diagnostic.h"
#include "legopt/import/internal/srdf.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Result of sampling, as dataset.yaml lists it, and its findings.
struct SampledDescription {
  DatasetDescription::SelfCollision pairs;
  std::vector<DatasetDiagnostic> findings;  ///< pairs that collide in the nominal posture only
};

/// Samples the link pairs of a robot (pair_sampling.h). `nominal_posture`: joint -> rad; unknown joints are ignored.
/// Throws InputError for a mesh that cannot be read.
SampledDescription SampleSelfCollision(const RobotModel& robot, const std::map<std::string, double>& nominal_posture,
                                       const PairSamplingOptions& options);

/// Lists the pairs that an SRDF excludes as not compared, except those that it calls adjacent or never in collision,
/// about which the samples decide. Returns a finding if there are any.
std::vector<DatasetDiagnostic> ExcludeSrdfPairs(const SrdfContent& srdf, const RobotModel& robot,
                                                DatasetDescription::SelfCollision* pairs);

/// Numbers of link pairs of a dataset that lists its unchecked pairs.
struct PairCounts {
  int checked = 0;                            ///< compared by every rule
  EnumArray<UncheckedReason, int> unchecked;  ///< per reason
};
/// Counts the pairs; all zero for a dataset without a list.
PairCounts CountPairs(const Dataset& dataset);

/// Formats the `count` unchecked pairs that overlap most in the nominal posture, e.g. "a - b 12.3 mm (adjacent)", the
/// deepest first; "none" if no pair overlaps.
std::string DescribeDeepestPairs(const Dataset& dataset, int count);

/// Reports the link pairs that are not compared: their number per reason, and the three that overlap most in the
/// nominal posture. Nothing for a dataset without a list.
std::vector<DatasetDiagnostic> CheckUncheckedPairs(const Dataset& dataset);

}  // namespace legopt
