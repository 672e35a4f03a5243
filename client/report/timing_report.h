#pragma once

#include <string>
#include <vector>

#include "client/report/listing.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dynamics/motion_timer.h"
#include "legopt/judge/solution_file.h"

namespace legopt {
namespace client {

/// Rows of a listing of durations.
enum class DurationRows {
  kMethods,  ///< one row per method
  kMotions   ///< one row per motion, with its limits and the point that blocks it
};

}  // namespace client

template <>
inline constexpr auto kEnumNames<client::DurationRows> = MakeEnumNames<client::DurationRows>(
    {{client::DurationRows::kMethods, "methods"}, {client::DurationRows::kMotions, "motions"}});

}  // namespace legopt

namespace legopt::client {

/// A motion of a solution file with its time law.
struct TimedSolution {
  std::string method;
  int problem_id = 0;
  int num_stances = 0;
  std::string fault;    ///< reason why the solution cannot be read as a motion; empty if it can
  MotionTiming timing;  ///< undefined with a fault
};

/// Computes the time laws of all motions of a file, in its order, on `threads` threads. Problems without a definition
/// in the file use the dataset's. Throws InputError for a file of postures, and for a problem that neither defines.
std::vector<TimedSolution> TimeSolutions(const SolutionFile& file, const Dataset& dataset, int threads);

/// Returns one row per motion. Durations in s; shares of the duration by limit; nulls where there is no time law, or a
/// `fault`.
Listing ListingOf(const std::vector<TimedSolution>& solutions);

/// Returns one row per method: motions, those with a time law (also with reduced limits), and medians over these.
Listing SummaryOf(const std::vector<TimedSolution>& solutions);

}  // namespace legopt::client
