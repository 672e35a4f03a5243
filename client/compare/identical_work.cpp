#include "client/compare/identical_work.h"

#include <algorithm>
#include <limits>

namespace legopt::client {

double IdenticalWork::Margin() const {
  if (!(time.interval.lower > 0.0)) return std::numeric_limits<double>::infinity();
  return std::max(time.interval.upper, 1.0 / time.interval.lower) - 1.0;
}

std::vector<IdenticalWork> ReadIdenticalWork(ResultSource& source, const SolvedExperiment& experiment, Rule rule,
                                             const ComparisonOptions& options) {
  std::vector<IdenticalWork> identical;
  const std::vector<SolveCell>& cells = experiment.cells;
  for (auto cell = cells.begin(); cell != cells.end(); ++cell) {
    for (auto copy = cell + 1; copy != cells.end(); ++copy) {
      if (copy->column != cell->column || copy->method.hash != cell->method.hash) continue;
      SolvedExperiment both = experiment;
      both.cells = {*cell, *copy};
      ReadSolves(source, rule, &both);
      const CellComparison compared = CompareCells(both.cells[0], both.cells[1], {}, options);
      if (compared.time.test.pairs == 0) continue;
      identical.push_back({cell->column, cell->method, copy->method, compared.time});
    }
  }
  return identical;
}

void RaiseTimeMargins(std::span<const IdenticalWork> identical, std::vector<CellComparison>* cells) {
  for (CellComparison& cell : *cells) {
    for (const IdenticalWork& work : identical) {
      if (work.column == cell.column) cell.time_margin = std::max(cell.time_margin, work.Margin());
    }
  }
}

}  // namespace legopt::client
