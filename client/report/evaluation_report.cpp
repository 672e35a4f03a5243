#include "client/report/evaluation_report.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "client/report/escaped_text.h"
#include "client/report/listing.h"
#include "client/report/violation_list.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr char kNotPosedTitle[] = "Problems that the dataset does not have";
constexpr char kNote[] =
    "Costs and times are averaged over successfully solved problems, per waypoint. Problems missing in the file count "
    "as "
    "not solved.";

nlohmann::json Number(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

std::optional<double> Optional(double value) { return std::isfinite(value) ? std::optional(value) : std::nullopt; }

std::string Plural(std::size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

std::string ProblemsLine(const EvaluationReport& report) {
  std::string text;
  if (report.num_posed == 0) {
    text = "The dataset has no " + std::string(ToString(report.task)) + " problems.";
  } else {
    text = "The file holds " + std::to_string(report.in_file.size()) + " of the dataset's " +
           std::to_string(report.num_posed) + " problems" +
           (static_cast<int>(report.in_file.size()) < report.num_posed ? "; the others count as not solved." : ".");
  }
  if (report.not_posed.empty()) return text;
  return text + "\n" + Plural(report.not_posed.size(), "problem") + " (" + RangesOf(report.not_posed) +
         ") that the dataset does not have " + (report.not_posed.size() == 1 ? "is" : "are") + " counted apart.";
}

std::string DefinitionsLine(const EvaluationReport& report) {
  if (!report.defines) return "Definitions: the dataset's; the file has none.";
  const bool of_file = report.definitions == Definitions::kFile;
  std::string text = of_file ? "Definitions: the file's own, as in the original evaluator; "
                             : "Definitions: the dataset's where it has the problem; ";
  if (report.in_file.empty()) return text + "the dataset has none of these problems.";
  if (report.differing.empty())
    return text + (of_file ? "they are the same as the dataset's." : "those of the file are the same.");
  text += std::to_string(report.differing.size()) + " of " + std::to_string(report.in_file.size()) +
          " in the file differ from the dataset's (" + RangesOf(report.differing) + ")";
  return text + (of_file ? ".\nWith --definitions dataset the dataset's count." : ".");
}

bool LeavesOut(const EvaluationReport& report) {
  return std::any_of(report.summaries.begin(), report.summaries.end(),
                     [](const MethodSummary& summary) { return !summary.missing.empty(); });
}

bool DefinitionsDiffer(const EvaluationReport& report) {
  return report.definitions == Definitions::kFile && !report.differing.empty();
}

int InFile(const MethodSummary& summary) { return summary.num_problems - static_cast<int>(summary.missing.size()); }

// As in the benchmark table: n in the success cell, a dash if nothing was solved.
Table SummaryTable(const EvaluationReport& report, const std::vector<MethodSummary>& summaries, const TimeUnit& unit) {
  const bool posed = &summaries == &report.summaries;
  const bool in_file = posed && LeavesOut(report), other = posed && DefinitionsDiffer(report);
  Table table;
  table.columns = {{"method", "", "", Alignment::kLeft}, {"success"}};
  if (in_file) table.columns.push_back({"in file"});
  if (other) table.columns.push_back({"by file's own definition"});
  table.columns.push_back({"cost"});
  table.columns.push_back({"time", "", unit.name});
  for (const auto& summary : summaries) {
    auto& cells = table.rows.emplace_back().cells;
    cells = {TextCell(summary.method), SuccessCell(summary.num_solved, summary.num_problems)};
    if (in_file) cells.push_back(CountCell(InFile(summary)));
    if (other) cells.push_back(CountCell(summary.num_other_definition));
    const auto cost = Optional(summary.mean_cost), time_s = Optional(summary.mean_time_s);
    cells.push_back(FigureCell(cost, FormatCost(cost)));
    cells.push_back(FigureCell(time_s, FormatTime(time_s, unit)));
  }
  table.notes = {{kNote}};
  return table;
}

Listing FailureListing(const EvaluationReport& report) {
  Listing listing;
  listing.columns = {"method", "problem", "verdict", "waypoint", "detail"};
  for (const auto& row : report.rows) {
    const Verdict verdict = row.evaluation.by(report.rule);
    if (verdict == Verdict::kSuccess) continue;
    const int waypoint = row.evaluation.failed_waypoint;
    listing.rows.push_back({row.method, row.problem_id, std::string(ToString(verdict)),
                            waypoint < 0 ? nlohmann::json() : nlohmann::json(waypoint), row.evaluation.detail});
  }
  return listing;
}

// Returns the values between waypoints, one line per checked solution.
Listing InterpolationListing(const EvaluationReport& report) {
  Listing listing;
  listing.columns = {"method", "problem", "free_share", "environment_depth_m", "self_depth_m"};
  for (const auto& row : report.rows) {
    const InterpolationScore& score = row.evaluation.interpolation;
    if (std::isnan(score.free_share)) continue;
    listing.rows.push_back(
        {row.method, row.problem_id, score.free_share, score.environment_depth_m, score.self_depth_m});
  }
  return listing;
}

// Returns how many postures of accepted solutions contacts and joints can hold, one line per method.
Listing HoldingListing(const EvaluationReport& report) {
  struct Sum {
    int solved = 0, held = 0;
    HoldingScore at, halfway;
  };
  std::map<std::string, Sum> sums;
  for (const auto& row : report.rows) {
    const Evaluation& e = row.evaluation;
    if (e.by(report.rule) != Verdict::kSuccess || e.holding.postures == 0) continue;
    Sum& sum = sums[row.method];
    ++sum.solved;
    if (e.holding.without_equilibrium + e.holding.over_torque == 0) ++sum.held;
    sum.at += e.holding;
    sum.halfway += e.holding_halfway;
  }
  Listing listing;
  listing.columns = {"method",
                     "solved",
                     "held",
                     "postures",
                     "without_equilibrium",
                     "over_torque",
                     "halfway_postures",
                     "halfway_without_equilibrium",
                     "halfway_over_torque"};
  for (const auto& [method, sum] : sums) {
    listing.rows.push_back({method, sum.solved, sum.held, sum.at.postures, sum.at.without_equilibrium,
                            sum.at.over_torque, sum.halfway.postures, sum.halfway.without_equilibrium,
                            sum.halfway.over_torque});
  }
  return listing;
}

// Methods that omit the same problems share a line.
Listing MissingListing(const EvaluationReport& report) {
  Listing listing;
  listing.columns = {"problems without a solution", "methods"};
  std::map<std::vector<int>, std::vector<std::string>> methods;
  for (const auto& summary : report.summaries) {
    if (!summary.missing.empty()) methods[summary.missing].push_back(summary.method);
  }
  for (const auto& [missing, names] : methods) {
    std::string text = names.front();
    for (std::size_t i = 1; i < names.size(); ++i) text += "; " + names[i];
    listing.rows.push_back({RangesOf(missing), names.size() == report.summaries.size() ? "all" : text});
  }
  return listing;
}

std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text.substr(0, text.find_last_not_of(' ') + 1);
}

// Returns one line per method, unrounded.
Listing SummaryListing(const EvaluationReport& report) {
  Listing listing;
  listing.columns = {
      "method",         "problems",     "solved",  "cost",        "time_s", "in_file", "solved_by_other_definition",
      "other_problems", "other_solved", "dataset", "definitions", "rule"};
  for (const auto& summary : report.summaries) {
    listing.rows.push_back({summary.method, summary.num_problems, summary.num_solved, Number(summary.mean_cost),
                            Number(summary.mean_time_s), InFile(summary), summary.num_other_definition});
  }
  if (report.num_posed == 0) {
    for (const auto& other : report.not_posed_summaries) {
      listing.rows.push_back({other.method, 0, 0, nullptr, nullptr, 0, 0});
    }
  }
  for (auto& row : listing.rows) {
    const auto other = std::find_if(report.not_posed_summaries.begin(), report.not_posed_summaries.end(),
                                    [&](const MethodSummary& summary) { return summary.method == row[0]; });
    const bool any = other != report.not_posed_summaries.end();
    row.emplace_back(any ? other->num_problems : 0);
    row.emplace_back(any ? other->num_solved : 0);
    row.insert(row.end(), {report.dataset, ToString(report.definitions), ToString(report.rule)});
  }
  return listing;
}

nlohmann::ordered_json HoldingJson(const HoldingScore& score) {
  return {{"postures", score.postures},
          {"without_equilibrium", score.without_equilibrium},
          {"over_torque", score.over_torque}};
}

nlohmann::ordered_json TimingJson(const MotionTiming& timing) {
  return {{"duration_s", Number(timing.shortest_s)},
          {"greedy_s", Number(timing.greedy_s)},
          {"uniform_s", Number(timing.uniform_s)},
          {"reduced_s", Number(timing.reduced_s)},
          {"velocity", timing.limits.velocity},
          {"torque", timing.limits.torque},
          {"contact", timing.limits.contact},
          {"blocked_at", timing.blocked_at < 0.0 ? nlohmann::json() : nlohmann::json(timing.blocked_at)},
          {"blocked_by", timing.blocked_by}};
}

nlohmann::ordered_json RowJson(const JudgedRow& row) {
  const Evaluation& e = row.evaluation;
  return {{"method", row.method},
          {"problem", row.problem_id},
          {"in_dataset", row.posed},
          {"other_definition", row.other_definition},
          {"verdict_literal", ToString(e.literal)},
          {"verdict_strict", ToString(e.strict)},
          {"verdict_solid", ToString(e.solid)},
          {"verdict_physical", ToString(e.physical)},
          {"detail", e.detail},
          {"failed_waypoint", e.failed_waypoint < 0 ? nlohmann::json() : nlohmann::json(e.failed_waypoint)},
          {"cost", Number(e.cost)},
          {"time_s", Number(row.time_s / e.num_waypoints)},
          {"waypoints", e.num_waypoints},
          {"violations", ListingToJson(ViolationListing(e.violations))},
          {"interpolation_environment_depth_m", Number(e.interpolation.environment_depth_m)},
          {"interpolation_self_depth_m", Number(e.interpolation.self_depth_m)},
          {"interpolation_free_share", Number(e.interpolation.free_share)},
          {"holding", HoldingJson(e.holding)},
          {"holding_halfway", HoldingJson(e.holding_halfway)},
          {"timing", e.timing ? TimingJson(*e.timing) : nlohmann::ordered_json()},
          {"claim_differs", row.claim_differs},
          {"unreadable", row.unreadable}};
}

nlohmann::ordered_json MethodsJson(const EvaluationReport& report) {
  auto methods = ListingToJson(SummaryListing(report));
  for (std::size_t i = 0; i < report.summaries.size(); ++i) methods[i]["missing"] = report.summaries[i].missing;
  return methods;
}

std::string RenderJson(const EvaluationReport& report) {
  nlohmann::ordered_json json = {{"file", report.file},
                                 {"dataset", report.dataset},
                                 {"task", ToString(report.task)},
                                 {"rule", ToString(report.rule)},
                                 {"definitions", ToString(report.definitions)},
                                 {"dataset_problems", report.num_posed},
                                 {"in_file", report.in_file},
                                 {"differing_definitions", report.differing},
                                 {"other_problems", report.not_posed},
                                 {"caption", OneLine(EvaluationCaption(report))}};
  json["methods"] = MethodsJson(report);
  json["solutions"] = nlohmann::ordered_json::array();
  for (const auto& row : report.rows) json["solutions"].push_back(RowJson(row));
  json["warnings"] = report.warnings;
  return JsonText(json) + "\n";
}

// Compares counts by the table's rule with those by the solid and the physical one.
std::string OtherRulesLine(const EvaluationReport& report) {
  std::string lines;
  for (const Rule rule : {Rule::kSolid, Rule::kPhysical}) {
    if (rule == report.rule || report.rows.empty()) continue;
    std::string text;
    for (const auto& summary : report.summaries) {
      const auto solved = std::ranges::count_if(report.rows, [&](const auto& row) {
        return row.method == summary.method && row.posed && row.evaluation.by(rule) == Verdict::kSuccess;
      });
      text += (text.empty() ? "" : "; ") + summary.method + " " + std::to_string(solved) + "/" +
              std::to_string(summary.num_problems);
    }
    lines += "Solved by the " + std::string(ToString(rule)) + " rule: " + text + ".\n";
  }
  return lines;
}

// Renders the selected rows and columns of the table of methods.
std::string RenderPart(EvaluationReport report, TableFormat format, const TableStyle& style,
                       const std::vector<std::string>& rows) {
  KeepRows(rows, report.summaries.empty() ? &report.not_posed_summaries : &report.summaries);
  const Table table =
      IsExact(format) ? TableOf(SummaryListing(report)) : TablesOf(report, style.time_unit, false).front();
  return RenderTable(KeepColumns(table, style.columns), format, style.layout);
}

}  // namespace

std::string EvaluationCaption(const EvaluationReport& report) {
  return report.file + ": " + std::string(ToString(report.task)) + ", dataset " + report.dataset + ", " +
         std::string(ToString(report.rule)) + " rule.\n" + ProblemsLine(report) + "\n" + DefinitionsLine(report) +
         "\n" + OtherRulesLine(report);
}

std::vector<Table> TablesOf(const EvaluationReport& report, const TimeUnit& unit, bool with_solutions) {
  std::vector<Table> tables;
  const auto add = [&](const std::string& title, Table table) {
    if (table.rows.empty()) return;
    table.title = {title};
    tables.push_back(std::move(table));
  };
  add("", SummaryTable(report, report.summaries, unit));
  add(kNotPosedTitle, SummaryTable(report, report.not_posed_summaries, unit));
  if (with_solutions) {
    add("Not solved", TableOf(FailureListing(report)));
    add("Left out", TableOf(MissingListing(report)));
    add("Between waypoints", TableOf(InterpolationListing(report)));
    add("Postures that contacts and joints can hold", TableOf(HoldingListing(report)));
  }
  if (tables.empty()) return tables;
  std::vector<std::string>& title = tables.front().title;
  if (title.front().empty()) title.clear();
  std::vector<std::string> caption;
  ClassicInput lines(EvaluationCaption(report));
  for (std::string line; std::getline(lines, line);) caption.push_back(line);
  title.insert(title.begin(), caption.begin(), caption.end());
  return tables;
}

std::string RenderEvaluation(const EvaluationReport& report, TableFormat format, const TableStyle& style,
                             const std::vector<std::string>& rows) {
  if (!rows.empty() || !style.columns.empty()) return RenderPart(report, format, style, rows);
  if (format == TableFormat::kJson) return RenderJson(report);
  if (format == TableFormat::kCsv) return RenderListing(SummaryListing(report), format);
  return RenderTables(TablesOf(report, style.time_unit, format != TableFormat::kLatex), format, style.layout);
}

}  // namespace legopt::client
