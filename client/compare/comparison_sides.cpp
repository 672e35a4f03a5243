#include "client/compare/comparison_sides.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <utility>

#include "client/client_error.h"
#include "client/report/method_choice.h"
#include "db/named_queries.h"
#include "legopt/input/text.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

struct Side {
  std::shared_ptr<ResultSource> source;
  std::string place;  // location of the results: canonical path of the file, or empty
  SolvedExperiment experiment;
  std::optional<MethodIdentity> method;  // nullopt: all methods
  std::string title;
};

struct Sides {
  Side a, b;
};

bool IsFile(const std::string& text) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(text, ignored);
}

std::string Titled(const SolvedExperiment& experiment) {
  return "experiment " + std::to_string(experiment.info.id) + " '" + experiment.info.name + "'";
}

Side FileSide(const std::string& file, const ComparisonRequest& request) {
  Side side;
  side.source = OpenResults({file, {}});
  side.place = std::filesystem::canonical(file).string();
  side.experiment = ReadCells(*side.source, request.experiment);
  side.title = Titled(side.experiment) + " of " + file;
  return side;
}

// Returns the experiment with this number or name; the newest one with the name.
std::optional<std::int64_t> ExperimentOf(const std::string& text, ResultSource& source) {
  const bool number = !text.empty() && text.size() < 18 &&
                      std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (number) return ParseInteger<std::int64_t>(text);
  if (FirstInvalidByte(text) < text.size()) return std::nullopt;  // names are UTF-8
  const Listing found = source.Query(db::Sql(db::Query::kNewestExperimentOfName, {{"name", text}}));
  const nlohmann::json& id = found.At(0, "id");
  return id.is_null() ? std::nullopt : std::optional(id.get<std::int64_t>());
}

[[noreturn]] void RefuseUnknown(const std::string& text, const SolvedExperiment& newest) {
  throw ClientError(ExitCode::kUsage, "'" + text + "' is no database file, no experiment, and no method of " +
                                          Titled(newest) + "; " + SuggestMethod(text, newest.Methods()));
}

Side MethodSide(const Side& common, const MethodIdentity& method) {
  Side side = common;
  side.method = method;
  side.title = ChoiceOf(method, common.experiment.Methods()) + " of " + Titled(common.experiment);
  return side;
}

Side ExperimentSide(const Side& common, std::int64_t id) {
  Side side = common;
  side.experiment = ReadCells(*common.source, id);
  side.title = Titled(side.experiment);
  return side;
}

// Returns the control and all methods of its experiment.
Sides ControlSides(const ComparisonRequest& request) {
  Side all;
  all.source = OpenResults(request.source);
  if (request.source.db) all.place = *request.source.db;
  all.experiment = ReadCells(*all.source, request.experiment);
  all.title = "each other method of " + Titled(all.experiment);
  return {MethodSide(all, ChooseMethod(request.control, all.experiment.Methods(), all.experiment.info.id)), all};
}

// Finds both sides in one database: methods of an experiment if A is one, else experiments.
Sides SidesOfOneDatabase(const ComparisonRequest& request) {
  Side common;
  common.source = OpenResults(request.source);
  if (request.source.db) common.place = *request.source.db;
  common.experiment = ReadCells(*common.source, request.experiment);
  const std::vector<MethodIdentity> methods = common.experiment.Methods();
  if (request.experiment) {
    return {MethodSide(common, ChooseMethod(request.a, methods, common.experiment.info.id)),
            MethodSide(common, ChooseMethod(request.b, methods, common.experiment.info.id))};
  }
  if (const auto method = FindMethod(request.a, methods)) {
    return {MethodSide(common, *method),
            MethodSide(common, ChooseMethod(request.b, methods, common.experiment.info.id))};
  }
  const auto a = ExperimentOf(request.a, *common.source);
  if (!a) RefuseUnknown(request.a, common.experiment);
  const auto b = ExperimentOf(request.b, *common.source);
  if (!b) RefuseUnknown(request.b, common.experiment);
  return {ExperimentSide(common, *a), ExperimentSide(common, *b)};
}

Sides FindSides(const ComparisonRequest& request) {
  if (!request.control.empty()) return ControlSides(request);
  const bool file_a = IsFile(request.a), file_b = IsFile(request.b);
  if (file_a && file_b) return {FileSide(request.a, request), FileSide(request.b, request)};
  if (file_a || file_b) {
    throw ClientError(ExitCode::kUsage, "'" + (file_a ? request.a : request.b) + "' is a file, '" +
                                            (file_a ? request.b : request.a) +
                                            "' is none; give two database files, two experiments or two methods");
  }
  return SidesOfOneDatabase(request);
}

void RequireDistinctSides(const Sides& sides) {
  const auto& [a, b] = sides;
  if (a.place != b.place || a.experiment.info.id != b.experiment.info.id) return;
  if (a.method && !b.method) return;  // a control
  if (a.method && b.method && a.method->method_id != b.method->method_id) return;
  throw ClientError(ExitCode::kUsage, "A and B are the same, " + a.title + "; a comparison takes two");
}

void RequireOneDataset(const Sides& sides) {
  const ExperimentInfo &a = sides.a.experiment.info, &b = sides.b.experiment.info;
  if (a.dataset_hash == b.dataset_hash) return;
  constexpr std::size_t kShown = 12;
  throw ClientError(ExitCode::kDatasetMismatch,
                    sides.a.title + " ran on dataset " + a.dataset_name + " (" + a.dataset_hash.substr(0, kShown) +
                        "), " + sides.b.title + " on " + b.dataset_name + " (" + b.dataset_hash.substr(0, kShown) +
                        "); their problems are not the same, so that nothing can be paired");
}

// Removes the cells that the filter omits: of A, so that those of B have no counterpart, or of the methods beside a
// control.
void FilterA(const ResultFilter& filter, Sides* sides) {
  ResultFilter methods = filter;
  methods.tasks.clear();
  methods.initializations.clear();
  if (sides->a.method && sides->b.method && !methods.empty()) {
    throw ClientError(ExitCode::kUsage, Describe(methods) + ": A and B are methods; this option selects methods of " +
                                            "two experiments or files");
  }
  // A control is kept whatever the filter; it selects the methods that are compared with it.
  SolvedExperiment& filtered = sides->a.method && !sides->b.method ? sides->b.experiment : sides->a.experiment;
  KeepCells(KeptCells(*sides->a.source, filtered.info.id, filter), &filtered);
}

// Returns the method of B that corresponds to `method` of A: equal name and properties; if several match, equal
// options.
std::optional<MethodIdentity> Counterpart(const MethodIdentity& method, const std::vector<MethodIdentity>& others) {
  std::optional<MethodIdentity> found;
  for (const MethodIdentity& other : others) {
    if (other.Same(method)) return other;
    const bool alike = other.name == method.name && other.multi_starts == method.multi_starts &&
                       other.sample_size == method.sample_size && other.incremental == method.incremental &&
                       other.collision == method.collision;
    if (alike && !found) found = other;
  }
  return found;
}

using MethodPair = std::pair<MethodIdentity, MethodIdentity>;

std::vector<MethodPair> PairsWithControl(const MethodIdentity& control, const SolvedExperiment& experiment) {
  std::vector<MethodPair> pairs;
  for (const MethodIdentity& method : experiment.Methods()) {
    if (method.method_id != control.method_id) pairs.emplace_back(control, method);
  }
  if (!pairs.empty()) return pairs;
  throw ClientError(ExitCode::kUsage, Titled(experiment) + " has no other method to compare with " + control.name +
                                          ", or the filters keep none");
}

std::vector<MethodPair> PairMethods(const Sides& sides, std::vector<std::string>* notes) {
  const auto& [a, b] = sides;
  if (a.method && b.method) return {{*a.method, *b.method}};
  if (a.method) return PairsWithControl(*a.method, b.experiment);
  const std::vector<MethodIdentity> ours = a.experiment.Methods();
  const std::vector<MethodIdentity> theirs = b.experiment.Methods();
  if (ours.size() == 1 && theirs.size() == 1) return {{ours.front(), theirs.front()}};
  std::vector<MethodPair> pairs;
  std::string lost;
  for (const MethodIdentity& method : ours) {
    if (const auto other = Counterpart(method, theirs)) {
      pairs.emplace_back(method, *other);
    } else {
      lost += (lost.empty() ? "" : ", ") + ChoiceOf(method, ours);
    }
  }
  if (pairs.empty()) {
    throw ClientError(ExitCode::kUsage, b.title + " has none of the methods of " + a.title + " (" + lost + "); " +
                                            SuggestMethod(ours.front().name, theirs));
  }
  if (!lost.empty()) notes->push_back("Only in A: " + lost + ".");
  return pairs;
}

SolveCell* CellOf(SolvedExperiment& experiment, const MethodIdentity& method, const BenchmarkColumn& column) {
  for (SolveCell& cell : experiment.cells) {
    if (cell.method.method_id == method.method_id && cell.column == column) return &cell;
  }
  return nullptr;
}

struct CellPair {
  SolveCell a, b;
};

std::vector<SolveCell> CellsOf(const std::vector<CellPair>& pairs) {
  std::vector<SolveCell> cells;
  for (const CellPair& pair : pairs) cells.insert(cells.end(), {pair.a, pair.b});
  return cells;
}

// Returns the weaker of both experiments' rules, because both have verdicts by that one.
Rule RuleOf(const Sides& sides, const ComparisonRequest& request) {
  return request.rule.value_or(std::min(sides.a.experiment.info.rule, sides.b.experiment.info.rule));
}

// Returns the comparable cells with their solves; other cells are not read.
std::vector<CellPair> PairCells(Sides& sides, const std::vector<MethodPair>& methods,
                                const ComparisonRequest& request) {
  std::vector<CellPair> pairs;
  for (const auto& [mine, other] : methods) {
    for (const BenchmarkColumn& column : kTableColumns) {
      const SolveCell* a = CellOf(sides.a.experiment, mine, column);
      const SolveCell* b = CellOf(sides.b.experiment, other, column);
      if (a != nullptr && b != nullptr) pairs.push_back({*a, *b});
    }
  }
  if (sides.a.source == sides.b.source && sides.a.experiment.info.id == sides.b.experiment.info.id) {
    std::int64_t jobs = 0;
    for (const CellPair& pair : pairs) jobs += pair.a.num_jobs + pair.b.num_jobs;
    sides.a.source->AnnounceJobs(jobs, sides.a.experiment.info.id);
  }
  const auto read = [&](Side& side, SolveCell CellPair::*cell) {
    SolvedExperiment chosen = side.experiment;
    chosen.cells.clear();
    for (CellPair& pair : pairs) chosen.cells.push_back(std::move(pair.*cell));
    ReadSolves(*side.source, RuleOf(sides, request), &chosen);
    for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].*cell = std::move(chosen.cells[i]);
  };
  read(sides.a, &CellPair::a);
  read(sides.b, &CellPair::b);
  return pairs;
}

// Returns the distinct texts of the origins, "a, b".
template <class Get>
std::string Listed(const std::vector<ResultProvenance>& origins, const Get& get) {
  std::vector<std::string> texts;
  for (const ResultProvenance& origin : origins) {
    const std::string text = get(origin).empty() ? "unknown" : get(origin);
    if (std::find(texts.begin(), texts.end(), text) == texts.end()) texts.push_back(text);
  }
  std::sort(texts.begin(), texts.end());
  std::string listed;
  for (const std::string& text : texts) listed += (listed.empty() ? "" : ", ") + text;
  return listed.empty() ? "unknown" : listed;
}

void NoteOrigins(const Sides& sides, std::vector<std::string>* notes) {
  const auto note = [&](const char* what, const char* consequence, std::string ResultProvenance::*figure) {
    const auto get = [&](const ResultProvenance& origin) { return origin.*figure; };
    const std::string a = Listed(sides.a.experiment.origins, get), b = Listed(sides.b.experiment.origins, get);
    if (a != b) notes->push_back("Different " + std::string(what) + ": A " + a + ", B " + b + "; " + consequence + ".");
    if (a == b && a.find(", ") != std::string::npos) {
      notes->push_back("Several " + std::string(what) + ": " + a + "; " + consequence + ".");
    }
  };
  note("builds", "what differs may be the build's doing", &ResultProvenance::build_id);
  note("processors", "times are not comparable", &ResultProvenance::processor);
}

void NoteSettings(const Sides& sides, const std::vector<CellPair>& pairs, std::vector<std::string>* notes) {
  const SolvedExperiment &a = sides.a.experiment, &b = sides.b.experiment;
  if (a.seed != b.seed) {
    notes->push_back("Different seeds: A " + std::to_string(a.seed) + ", B " + std::to_string(b.seed) + ".");
  }
  if (a.repetitions != b.repetitions) {
    notes->push_back("Different repetitions: A " + std::to_string(a.repetitions) + ", B " +
                     std::to_string(b.repetitions) + "; each problem counts once.");
  }
  const bool limits =
      std::any_of(pairs.begin(), pairs.end(), [](const auto& p) { return p.a.limit_ms != p.b.limit_ms; });
  if (limits) notes->push_back("Different time limits: runs beyond the smaller one count as failed.");
  if (!sides.a.method) {
    const bool options =
        std::any_of(pairs.begin(), pairs.end(), [](const auto& p) { return p.a.method.hash != p.b.method.hash; });
    if (options) notes->push_back("Methods that are compared have different options.");
  }
}

void NoteClock(const Sides& sides, std::vector<std::string>* notes) {
  const std::int64_t a = sides.a.experiment.clock_stopped, b = sides.b.experiment.clock_stopped;
  if (a + b == 0) return;
  notes->push_back("The clock ended jobs of the experiments, " + std::to_string(a) + " of A's, " + std::to_string(b) +
                   " of B's: they count as failures, and say nothing about a method.");
}

void AddReusedResultsNote(const Sides& sides, std::vector<std::string>* notes) {
  const std::int64_t a = sides.a.experiment.taken_over, b = sides.b.experiment.taken_over;
  if (a + b == 0) return;
  const bool same = sides.a.place == sides.b.place && sides.a.experiment.info.id == sides.b.experiment.info.id;
  notes->push_back("Results reused from other experiments: " +
                   (same ? std::to_string(a) : "A " + std::to_string(a) + ", B " + std::to_string(b)) +
                   (same ? "." : "; what A and B both have of one solve is equal by its making."));
}

void NoteCells(const std::vector<CellComparison>& cells, std::vector<std::string>* notes) {
  constexpr double kTold = 0.2, kHundredth = 0.01;
  int missing = 0, only_a = 0, only_b = 0;
  double contended = 0.0;
  for (const CellComparison& cell : cells) {
    missing += cell.success.counts.missing;
    only_a += cell.only_in_a;
    only_b += cell.only_in_b;
    contended = std::max(contended, cell.contended_share);
  }
  if (missing > 0) notes->push_back(std::to_string(missing) + " pairs are missing: queued, running or cancelled.");
  if (only_a + only_b > 0) {
    notes->push_back("Problems without a partner: " + std::to_string(only_a) + " of A, " + std::to_string(only_b) +
                     " of B; they do not count.");
  }
  if (contended > kTold) {
    notes->push_back("Up to " + std::to_string(std::lround(contended / kHundredth)) +
                     " % of the runs were disturbed by others.");
  }
}

// Reads how times of identical work differ in the experiments of both sides.
std::vector<IdenticalWork> IdenticalWorkOf(const Sides& sides, const ComparisonRequest& request) {
  const auto& [a, b] = sides;
  ComparisonOptions options = request.options;
  options.family = 1;  // a margin is no test
  std::vector<IdenticalWork> identical = ReadIdenticalWork(*a.source, a.experiment, RuleOf(sides, request), options);
  if (a.place == b.place && a.experiment.info.id == b.experiment.info.id) return identical;
  for (IdenticalWork& work : ReadIdenticalWork(*b.source, b.experiment, RuleOf(sides, request), options)) {
    identical.push_back(std::move(work));
  }
  return identical;
}

}  // namespace

Comparison ReadComparison(const ComparisonRequest& request) {
  Sides sides = FindSides(request);
  RequireDistinctSides(sides);
  RequireOneDataset(sides);
  Comparison comparison;
  comparison.identical_work = IdenticalWorkOf(sides, request);  // before the filter removes methods
  FilterA(request.filter, &sides);
  const std::vector<MethodPair> methods = PairMethods(sides, &comparison.notes);
  std::vector<CellPair> pairs = PairCells(sides, methods, request);
  const EnumArray<Task, Charge> charges = ChargesOf(CellsOf(pairs), request.charge_ms);
  std::erase_if(pairs, [](const CellPair& pair) { return NumCommonProblems(pair.a, pair.b) == 0; });
  if (pairs.empty()) {
    throw ClientError(ExitCode::kUsage, "A (" + sides.a.title + ") and B (" + sides.b.title +
                                            ") have no problem in common that both have finished");
  }
  KeepRows(request.rows, &pairs);  // before intervals and p-values are adjusted for the number of comparisons
  comparison.options = request.options;
  comparison.options.family = std::max(request.options.family, static_cast<int>(pairs.size()));
  for (const CellPair& pair : pairs) {
    comparison.cells.push_back(CompareCells(pair.a, pair.b, charges[pair.a.column.task], comparison.options));
  }
  std::erase_if(comparison.identical_work, [&](const IdenticalWork& work) {
    return std::ranges::find(comparison.cells, work.column, &CellComparison::column) == comparison.cells.end();
  });
  RaiseTimeMargins(comparison.identical_work, &comparison.cells);
  Decide(comparison.options, &comparison.cells);
  comparison.change = OverallChange(comparison.cells);
  const auto told = [](const Side& side) {
    return ComparedSide{side.title, side.experiment.info.id, side.experiment.origins, side.experiment.taken_over};
  };
  comparison.a = told(sides.a);
  comparison.b = told(sides.b);
  comparison.dataset = sides.a.experiment.info.dataset_name;
  comparison.rule = RuleOf(sides, request);
  NoteOrigins(sides, &comparison.notes);
  NoteSettings(sides, pairs, &comparison.notes);
  NoteClock(sides, &comparison.notes);
  AddReusedResultsNote(sides, &comparison.notes);
  NoteCells(comparison.cells, &comparison.notes);
  return comparison;
}

}  // namespace legopt::client
