#pragma once

#include "legopt/solvers/subproblem/convex_subproblem.h"

namespace legopt {

struct RandomSubproblemShape {
  int num_blocks = 1;
  int block_size = 35;
  int cost_rows = 29;        ///< per block
  int equality_rows = 12;    ///< per block
  int inequality_rows = 30;  ///< per block
  bool coupled = false;      ///< costs and rows between consecutive blocks
  bool steps = false;        ///< those costs are squared steps, as in a motion, instead of dense
  int pair_rows = 3;         ///< rows between consecutive blocks
  bool chains = false;       ///< rows have only the columns of a kinematic chain; a few, such as the balance, have all
  double weight = 100.0;
  double box = 0.1;
  int fixed_variables = 0;  ///< number in the first block
};

/// Returns the shape of LegOpt-best's windows: the average numbers of rows and columns of motions.
inline RandomSubproblemShape WindowOfMotion(int num_waypoints) {
  return {.num_blocks = num_waypoints,
          .cost_rows = 0,
          .equality_rows = 10,
          .inequality_rows = 11,
          .coupled = true,
          .steps = true,
          .pair_rows = 0,
          .chains = true,
          .fixed_variables = 35};
}

/// Returns a subproblem of the given shape with entries similar to a posture's, determined by the seed.
ConvexSubproblem MakeRandomSubproblem(const RandomSubproblemShape& shape, unsigned seed);

}  // namespace legopt
