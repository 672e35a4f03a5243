#include "client/report/reading.h"

#include <algorithm>

#include "db/named_queries.h"

namespace legopt::client {
namespace {

// Returns whether all results of an experiment have a verdict by the rule.
bool HasVerdicts(ResultSource& source, std::int64_t experiment_id, Rule rule) {
  if (rule < Rule::kSolid) return true;
  return source.Query(db::Sql(db::Query::kResultsWithoutVerdict, {{"experiment_id", experiment_id}, {"rule", rule}}))
      .rows.empty();
}

// Adds counts by a second rule: the solid rule if the table's is another one, else the original evaluator's rule.
void AddOtherRule(ResultSource& source, BenchmarkTable* table) {
  const Rule other = table->rule == Rule::kSolid ? Rule::kLiteral : Rule::kSolid;
  if (!HasVerdicts(source, table->experiment_id, other)) return;
  const Listing counts =
      source.Query(db::Sql(db::Query::kSolvedByRule, {{"experiment_id", table->experiment_id}, {"rule", other}}));
  for (std::size_t i = 0; i < counts.rows.size(); ++i) {
    const BenchmarkColumn column{counts.EnumAt<Task>(i, "task"), counts.EnumAt<Initialization>(i, "initialization")};
    const auto method_id = counts.At(i, "method_id").get<std::int64_t>();
    for (BenchmarkRow& row : table->rows) {
      const auto cell = row.cells.find(column);
      if (row.method_id != method_id || cell == row.cells.end()) continue;
      cell->second.solved_by_other_rule = counts.At(i, "solved").get<std::int64_t>();
    }
  }
  table->other_rule = other;
}

// Adds the starts of methods with internal restarts, unless they have too many results to be read for a table.
void AddFurtherStarts(ResultSource& source, const KeptCells& kept, BenchmarkTable* table) {
  constexpr std::int64_t kMost = 50'000;
  std::vector<std::int64_t> methods;
  std::int64_t results = 0;
  for (const BenchmarkRow& row : table->rows) {
    if (row.inner_starts == 0) continue;
    methods.push_back(row.method_id);
    for (const auto& [column, cell] : row.cells) results += cell.finished;
  }
  if (methods.empty() || results > kMost) return;
  const Listing rows = source.Query(
      db::Sql(db::Query::kFurtherStarts,
              {{"experiment_id", table->experiment_id}, {"method_ids", methods}, {"cell_ids", kept.ids()}}));
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    const auto row =
        std::ranges::find(table->rows, rows.At(i, "method_id").get<std::int64_t>(), &BenchmarkRow::method_id);
    row->further_starts = {rows.At(i, "mean").get<double>(), rows.At(i, "largest").get<std::int64_t>()};
  }
}

// Removes the cells that are not kept, and rows without cells. `column_of` returns the column of a cell's key.
template <class Row, class ColumnOf>
void KeepCells(const KeptCells& kept, const ColumnOf& column_of, std::vector<Row>* rows) {
  for (Row& row : *rows) {
    std::erase_if(row.cells, [&](const auto& cell) { return !kept.Keeps(row.method_id, column_of(cell.first)); });
  }
  std::erase_if(*rows, [](const Row& row) { return row.cells.empty(); });
}

// Removes the columns without cells.
void KeepColumnsWithCells(BenchmarkTable* table) {
  std::erase_if(table->columns, [&](const BenchmarkColumn& column) {
    return std::ranges::none_of(table->rows, [&](const BenchmarkRow& row) { return row.cells.contains(column); });
  });
}

[[noreturn]] void RefuseInterpolation(std::int64_t experiment_id, const std::string& selection) {
  throw ClientError(ExitCode::kUsage, "experiment " + std::to_string(experiment_id) + " has no " +
                                          std::string(kInterpolatedTask.plural) + selection +
                                          "; only these have an interpolation");
}

}  // namespace

void RequireVerdicts(ResultSource& source, const ExperimentInfo& experiment, Rule rule) {
  if (HasVerdicts(source, experiment.id, rule)) return;
  const std::string id = std::to_string(experiment.id);
  throw ClientError(ExitCode::kUsage,
                    "experiment " + id + " has results of a release without the " + std::string(ToString(rule)) +
                        " rule; judge their solutions again: " + "'legopt export " + id + " --out FILE" +
                        source.flags() + "', then 'legopt evaluate FILE --rule " + std::string(ToString(rule)) + "'");
}

BenchmarkTable ReadBenchmarkTable(ResultSource& source, const TableSelection& selection) {
  const ExperimentInfo experiment = FindExperiment(source, selection.experiment);
  RequireVerdicts(source, experiment, selection.rule);
  auto table = BuildBenchmarkTable(source.Query(BenchmarkCellsSql(experiment.id, selection.rule)), experiment.id,
                                   selection.rule);
  table.dataset = experiment.dataset_name;
  table.split = experiment.split;
  table.origins = ReadOrigins(source, experiment.id);
  const KeptCells kept(source, experiment.id, selection.filter);
  KeepCells(
      kept, [](const BenchmarkColumn& column) { return column; }, &table.rows);
  KeepRows(selection.rows, &table.rows);
  KeepColumnsWithCells(&table);
  AddOtherRule(source, &table);
  AddFurtherStarts(source, kept, &table);
  return table;
}

InterpolationTable ReadInterpolationTable(ResultSource& source, const TableSelection& selection) {
  const ExperimentInfo experiment = FindExperiment(source, selection.experiment);
  RequireVerdicts(source, experiment, selection.rule);
  auto table = BuildInterpolationTable(source.Query(InterpolationCellsSql(experiment.id, selection.rule)),
                                       experiment.id, selection.rule);
  if (table.rows.empty()) RefuseInterpolation(experiment.id, "");
  table.dataset = experiment.dataset_name;
  table.split = experiment.split;
  table.origins = ReadOrigins(source, experiment.id);
  table.taken_over = CountReusedResults(source, experiment.id);
  const KeptCells kept(source, experiment.id, selection.filter);
  const auto column_of = [](Initialization initialization) {
    return BenchmarkColumn{kInterpolatedTask.task, initialization};
  };
  KeepCells(kept, column_of, &table.rows);
  if (table.rows.empty()) RefuseInterpolation(experiment.id, " among those of " + Describe(selection.filter));
  KeepRows(selection.rows, &table.rows);
  return table;
}

Listing ReadHolding(ResultSource& source, const TableSelection& selection) {
  const ExperimentInfo experiment = FindExperiment(source, selection.experiment);
  RequireVerdicts(source, experiment, selection.rule);
  const KeptCells kept(source, experiment.id, selection.filter);
  return source.Query(db::Sql(db::Query::kHoldingOfExperiment,
                              {{"experiment_id", experiment.id}, {"rule", selection.rule}, {"cell_ids", kept.ids()}}));
}

}  // namespace legopt::client
