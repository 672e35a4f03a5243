#pragma once

#include <span>
#include <vector>

#include "client/compare/comparison.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// Times of identical work in one experiment: of a method and of another one with the same options (`legopt run
/// --null`). Their solves differ in nothing but the time, so the difference is that of the machine: load, clock
/// frequency, place in memory.
struct IdenticalWork {
  BenchmarkColumn column;
  MethodIdentity method, copy;
  RatioComparison time;  ///< copy / method

  /// Returns the larger deviation from 1 of the interval's bounds, as a ratio above 1, minus 1: 0.25 for [0.8, 1.1].
  /// Infinite if the lower bound is 0.
  double Margin() const;
};

/// Returns one element for each column of an experiment and pair of methods with equal options. Reads the solves of
/// their cells. Pairs whose times are all equal are omitted: their results were reused from one solve. Throws the
/// errors of ReadSolves.
std::vector<IdenticalWork> ReadIdenticalWork(ResultSource& source, const SolvedExperiment& experiment, Rule rule,
                                             const ComparisonOptions& options);

/// Raises the margin of times of each cell to the largest margin of identical work in its column.
void RaiseTimeMargins(std::span<const IdenticalWork> identical, std::vector<CellComparison>* cells);

}  // namespace legopt::client
