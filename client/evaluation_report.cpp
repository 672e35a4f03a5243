#include "client/evaluation_report.h"

#include <cmath>

#include "client/benchmark_table.h"

namespace legopt::client {
namespace {

nlohmann::json Number(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

Verdict VerdictOf(const JudgedRow& row, Rule rule) {
  return rule == Rule::kLiteral ? row.evaluation.literal : row.evaluation.strict;
}

ProblemDefinition DefinitionOf(const SolvedProblem& problem, Task task, const Dataset& dataset,
                               std::vector<std::string>* warnings) {
  const int id = problem.definition.id;
  if (problem.definition.stances.empty()) return dataset.problem(task, id);
  for (const auto& known : dataset.problems(task)) {
    if (known.id == id && !(known == problem.definition)) {
      warnings->push_back("problem " + std::to_string(id) +
                          ": its definition differs from the dataset's; the file's own is used");
    }
  }
  return problem.definition;
}

Listing SummaryListing(const EvaluationReport& report) {
  Listing listing;
  listing.columns = {"method", "problems", "solved", "cost", "time_s"};
  for (const auto& summary : report.summaries) {
    listing.rows.push_back({summary.method, summary.num_problems, summary.num_solved, Number(summary.mean_cost),
                            Number(summary.mean_time_s)});
  }
  return listing;
}

// As in the benchmark table: n in the success cell, a dash where nothing was solved.
Listing ShownSummary(const EvaluationReport& report) {
  const auto optional = [](double value) { return std::isfinite(value) ? std::optional(value) : std::nullopt; };
  const TimeUnit unit = kMilliseconds;
  Listing listing;
  listing.columns = {"method", "success", "cost", "time (" + std::string(unit.name) + ")"};
  for (const auto& summary : report.summaries) {
    listing.rows.push_back({summary.method,
                            std::to_string(summary.num_solved) + "/" + std::to_string(summary.num_problems),
                            FormatCost(optional(summary.mean_cost)), FormatTime(optional(summary.mean_time_s), unit)});
  }
  return listing;
}

Listing FailureListing(const EvaluationReport& report) {
  Listing listing;
  listing.columns = {"method", "problem", "verdict", "waypoint", "detail"};
  for (const auto& row : report.rows) {
    const Verdict verdict = VerdictOf(row, report.rule);
    if (verdict == Verdict::kSuccess) continue;
    const int waypoint = row.evaluation.failed_waypoint;
    listing.rows.push_back({row.method, row.problem_id, std::string(ToString(verdict)),
                            waypoint < 0 ? nlohmann::json() : nlohmann::json(waypoint), row.evaluation.detail});
  }
  return listing;
}

// Motions between their waypoints, one line per solution that was looked at.
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

nlohmann::ordered_json RowJson(const JudgedRow& row) {
  const Evaluation& e = row.evaluation;
  return {{"method", row.method},
          {"problem", row.problem_id},
          {"verdict_literal", ToString(e.literal)},
          {"verdict_strict", ToString(e.strict)},
          {"detail", e.detail},
          {"failed_waypoint", e.failed_waypoint < 0 ? nlohmann::json() : nlohmann::json(e.failed_waypoint)},
          {"cost", Number(e.cost)},
          {"time_s", Number(row.time_s / e.num_waypoints)},
          {"waypoints", e.num_waypoints},
          {"foot_violation", Number(e.foot_violation)},
          {"com_violation_m", Number(e.com_violation_m)},
          {"limit_violation", Number(e.limit_violation)},
          {"environment_depth_m", Number(e.environment_depth_m)},
          {"self_depth_literal_m", Number(e.self_depth_literal_m)},
          {"self_depth_strict_m", Number(e.self_depth_strict_m)},
          {"interpolation_environment_depth_m", Number(e.interpolation.environment_depth_m)},
          {"interpolation_self_depth_m", Number(e.interpolation.self_depth_m)},
          {"interpolation_free_share", Number(e.interpolation.free_share)},
          {"claim_differs", row.claim_differs}};
}

std::string RenderJson(const EvaluationReport& report) {
  nlohmann::ordered_json json;
  json["task"] = ToString(report.task);
  json["rule"] = report.rule == Rule::kLiteral ? "literal" : "strict";
  json["methods"] = ListingToJson(SummaryListing(report));
  json["solutions"] = nlohmann::ordered_json::array();
  for (const auto& row : report.rows) json["solutions"].push_back(RowJson(row));
  json["warnings"] = report.warnings;
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

EvaluationReport EvaluateSolutions(const SolutionFile& file, Judge& judge, Rule rule) {
  EvaluationReport report;
  report.task = file.task;
  report.rule = rule;
  std::vector<JudgedSolution> judged;
  for (const auto& problem : file.problems) {
    if (problem.solutions.empty()) continue;
    const ProblemDefinition definition = DefinitionOf(problem, file.task, judge.dataset(), &report.warnings);
    for (const auto& solution : problem.solutions) {
      JudgedRow row{solution.method, definition.id, solution.time_s,
                    judge.Evaluate(file.task, definition, solution.waypoints), false};
      row.claim_differs = solution.success && *solution.success != (row.evaluation.literal == Verdict::kSuccess);
      if (row.claim_differs) {
        report.warnings.push_back("problem " + std::to_string(definition.id) + ", " + solution.method +
                                  ": the file says " + (*solution.success ? "success" : "no success") +
                                  ", the judge says " + std::string(ToString(row.evaluation.literal)));
      }
      judged.push_back({row.method, row.problem_id, row.time_s, row.evaluation});
      report.rows.push_back(std::move(row));
    }
  }
  report.summaries = Summarize(judged, rule);
  return report;
}

std::string RenderEvaluation(const EvaluationReport& report, ListingFormat format) {
  if (format == ListingFormat::kJson) return RenderJson(report);
  if (format == ListingFormat::kCsv) return RenderListing(SummaryListing(report), format);
  std::string text = RenderListing(ShownSummary(report), format);
  const Listing failures = FailureListing(report);
  if (!failures.rows.empty()) text += "\nNot solved\n\n" + RenderListing(failures, format);
  const Listing interpolation = InterpolationListing(report);
  if (!interpolation.rows.empty()) text += "\nBetween waypoints\n\n" + RenderListing(interpolation, format);
  return text;
}

}  // namespace legopt::client
