#include "client/compare/comparison_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "app/printable.h"
#include "client/report/benchmark_table.h"
#include "client/report/escaped_text.h"
#include "client/report/listing.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr double kPerSecond_ms = 1e3, kPercentPerShare = 100.0;

using Line = std::vector<std::string>;  // label, text

std::string Ratio(double value) { return FormatGeneral(value, 3); }
std::string Percent(double share) { return FormatFixed(kPercentPerShare * share, 1); }

std::string TimeText(double time_ms, const TimeUnit& unit) {
  return FormatTime(time_ms / kPerSecond_ms, unit) + " " + unit.name;
}

// Returns e.g. "0.012, adjusted 0.048"; a dash if there is nothing to test.
std::string P(double p, double adjusted, int informative) {
  if (informative == 0) return "-";
  return FormatGeneral(p, 2) + ", adjusted " + FormatGeneral(adjusted, 2);
}

// Returns the method that distinguishes a comparison from the others: that of A, or with a control that of B; nullptr
// if all are of the same two methods.
const MethodIdentity* DistinguishingMethod(const Comparison& comparison, const CellComparison& cell) {
  const CellComparison& first = comparison.cells.front();
  const auto differ = [&](MethodIdentity CellComparison::*method) {
    return std::ranges::any_of(comparison.cells, [&](const CellComparison& other) {
      return (other.*method).method_id != (first.*method).method_id;
    });
  };
  if (differ(&CellComparison::a)) return &cell.a;
  return differ(&CellComparison::b) ? &cell.b : nullptr;
}

struct ChangeWords {
  const char* better;
  const char* worse;
};
constexpr ChangeWords kSuccessWords = {"solves more", "solves fewer"}, kWorkWords = {"less work", "more work"},
                      kTimeWords = {"faster", "slower"}, kCostWords = {"cheaper", "dearer"};

void AddWords(ComparisonResult change, const ChangeWords& words, std::string* text) {
  if (change != ComparisonResult::kBetter && change != ComparisonResult::kWorse) return;
  *text += (text->empty() ? "" : ", ") + std::string(change == ComparisonResult::kBetter ? words.better : words.worse);
}

// Returns e.g. "better (faster, cheaper)".
std::string Verdict(const CellComparison& cell) {
  std::string reasons;
  AddWords(cell.success.change, kSuccessWords, &reasons);
  AddWords(cell.work.change, kWorkWords, &reasons);
  AddWords(cell.time.change, kTimeWords, &reasons);
  AddWords(cell.cost.change, kCostWords, &reasons);
  constexpr EnumArray<ComparisonResult, const char*> kVerdicts = {
      {{"no difference shown", "B is better", "B is worse", "mixed"}}};
  return kVerdicts[cell.change] + (reasons.empty() ? "" : " (" + reasons + ")");
}

std::string SuccessText(const SuccessComparison& success) {
  return "A " + Percent(success.share_a) + " %, B " + Percent(success.share_b) + " %; B - A " +
         Percent(success.difference.estimate) + " points [" + Percent(success.difference.interval.lower) + ", " +
         Percent(success.difference.interval.upper) + "]; " +
         (success.repeated ? "permutation p " + P(success.repeated->p, success.adjusted_p, success.repeated->pairs)
                           : "McNemar mid-p " + P(success.test.mid_p, success.adjusted_p, success.test.discordant));
}

std::string RatioText(const RatioComparison& ratios, const ChangeWords& words) {
  if (ratios.n == 0) return "- (nothing that both solved)";
  std::string text = "B / A " + Ratio(ratios.mean) + " [" + Ratio(ratios.interval.lower) + ", " +
                     Ratio(ratios.interval.upper) + "] on the " + std::to_string(ratios.n) +
                     " that both solved; Wilcoxon p " +
                     P(ratios.test.two_sided_p, ratios.adjusted_p, ratios.test.pairs);
  if (ratios.typical) {
    text += "; Hodges-Lehmann " + Ratio(ratios.typical->estimate) + " [" + Ratio(ratios.typical->interval.lower) +
            ", " + Ratio(ratios.typical->interval.upper) + "]";
  }
  text += "; B: " + std::string(words.better) + " on " + std::to_string(ratios.lower);
  if (ratios.test.zeros > 0) text += ", equal on " + std::to_string(ratios.test.zeros);
  return text;
}

std::string DistributionText(const CellComparison& cell, const TimeUnit& unit) {
  switch (cell.dominance) {
    case statistics::Dominance::kEqual:
      return "equal";
    case statistics::Dominance::kFirst:
      return "A dominates: at every time it has solved at least as many";
    case statistics::Dominance::kSecond:
      return "B dominates: at every time it has solved at least as many";
    case statistics::Dominance::kNone:
      return "they cross, first at " + TimeText(cell.crossing_ms.value_or(0.0), unit);
  }
  return {};
}

std::string ProblemsText(const std::vector<ProblemRatio>& ratios) {
  std::string text;
  for (const ProblemRatio& ratio : ratios) {
    text += (text.empty() ? "" : "; ") + std::to_string(ratio.problem) + ": " + Ratio(ratio.ratio) + " (jobs " +
            std::to_string(ratio.job_a) + ", " + std::to_string(ratio.job_b) + ")";
  }
  return text.empty() ? "none" : text;
}

std::vector<Line> LinesOf(const CellComparison& cell, const TimeUnit& unit) {
  return {{"pairs", DescribePairs(cell.success.counts)},
          {"success", SuccessText(cell.success)},
          {"work", cell.work.n == 0 && cell.time.n > 0 ? "- (not counted)" : RatioText(cell.work, kWorkWords)},
          {"time", RatioText(cell.time, kTimeWords)},
          {"cost", RatioText(cell.cost, kCostWords)},
          {TitleOfChargedMean(cell.charge.rule),
           "A " + TimeText(cell.par10_a_ms, unit) + ", B " + TimeText(cell.par10_b_ms, unit) + "; B / A " +
               Ratio(cell.par10_b_ms / cell.par10_a_ms) + " [" + Ratio(cell.par10_ratio.lower) + ", " +
               Ratio(cell.par10_ratio.upper) + "]; a failure costs " + DescribeCharge(cell.charge, unit)},
          {"runtimes", DistributionText(cell, unit)},
          {"B fastest", ProblemsText(cell.fastest)},
          {"B slowest", ProblemsText(cell.slowest)}};
}

// Returns the properties of a method that both sides share, for titles of comparisons of several methods.
std::string NameOf(const MethodIdentity& method) {
  return method.name + ", " + std::to_string(method.multi_starts) + " multi-starts, sample size " +
         std::to_string(method.sample_size) + " %, " + std::string(ToString(method.collision)) + " obstacles";
}

/// Returns how many problems a difference in success needs at least.
std::string LeastText(const Comparison& comparison) {
  const auto repeated = [](const CellComparison& cell) { return cell.success.repeated.has_value(); };
  if (std::ranges::any_of(comparison.cells, repeated)) {
    return " Fewer than 6 problems with different shares cannot show a difference in success.";
  }
  return " Fewer than " + std::to_string(MinDiscordantPairs()) +
         " problems that only one of both solves cannot show a difference in success.";
}

std::string RuleText(const Comparison& comparison) {
  const std::string margin =
      comparison.options.margin > 0 ? " by a margin of " + Percent(comparison.options.margin) + " %" : "";
  const auto family = static_cast<std::size_t>(comparison.options.family);
  const std::string intervals = family == 1 ? "Intervals are of 95 %"
                                            : "Each kind of interval contains all " + std::to_string(family) +
                                                  " values with a nominal probability of 95 % (Bonferroni)";
  const bool all_shown = family == comparison.cells.size();
  return intervals + "; p is adjusted by Holm over the " + std::to_string(family) +
         (all_shown ? " comparisons shown" : " comparisons of the whole document") +
         ", each test for itself. Rule: success decides where its adjusted p is below 0.05; else "
         "work and cost on what both solved, each where its interval lies beyond 1" +
         margin +
         " and its adjusted p is below 0.05. Work: term evaluations, weighted by kind, which do not depend on the "
         "load; "
         "where they were not counted, time decides." +
         LeastText(comparison);
}

// Returns e.g. "The same work differs: SQP (copy) takes 1.03 [0.98, 1.08] of the time of SQP, postures, good init;
// smaller differences of times are not reported (margin 8.2 %)."
std::string IdenticalWorkText(const IdenticalWork& work) {
  return "The same work differs: " + work.copy.name + " takes " + Ratio(work.time.mean) + " [" +
         Ratio(work.time.interval.lower) + ", " + Ratio(work.time.interval.upper) + "] of the time of " +
         work.method.name + ", " + ColumnTitle(work.column) +
         "; smaller differences of times are not reported (margin " + Percent(work.Margin()) + " %).";
}

// Returns e.g. "B is worse in 1 of 4 comparisons, better in 2, mixed in 0."
std::string Summary(const Comparison& comparison) {
  EnumArray<ComparisonResult, int> counts;
  for (const CellComparison& cell : comparison.cells) ++counts[cell.change];
  constexpr EnumArray<ComparisonResult, const char*> kSentences = {
      {{"No difference between A and B is shown", "B is better than A", "B is worse than A",
        "B is better than A in some respects, worse in others"}}};
  return std::string(kSentences[comparison.change]) + ": of " + std::to_string(comparison.cells.size()) +
         " comparisons better in " + std::to_string(counts[ComparisonResult::kBetter]) + ", worse in " +
         std::to_string(counts[ComparisonResult::kWorse]) + ", mixed in " +
         std::to_string(counts[ComparisonResult::kMixed]) + ".";
}

using Json = nlohmann::ordered_json;

Json Number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json IntervalJson(const statistics::Interval& interval) { return {Number(interval.lower), Number(interval.upper)}; }

Json MethodJson(const MethodIdentity& method) {
  return {{"name", method.name},
          {"multi_starts", method.multi_starts},
          {"inner_starts", method.inner_starts},
          {"sample_size", method.sample_size},
          {"incremental", method.incremental},
          {"collision", ToString(method.collision)},
          {"hash", method.hash}};
}

Json SuccessJson(const SuccessComparison& success) {
  return {{"share_a", success.share_a},
          {"share_b", success.share_b},
          {"difference", success.difference.estimate},
          {"interval", IntervalJson(success.difference.interval)},
          {"mcnemar_exact_p", success.test.exact_p},
          {"mcnemar_mid_p", success.test.mid_p},
          {"permutation_p", success.repeated ? Json(success.repeated->p) : Json()},
          {"adjusted_p", success.adjusted_p},
          {"change", ToString(success.change)}};
}

Json RatioJson(const RatioComparison& ratios) {
  const auto tested = [&](double value) { return ratios.n == 0 ? Json() : Json(value); };
  return {{"n", ratios.n},
          {"ratio", Number(ratios.mean)},
          {"interval", ratios.n == 0 ? Json{Json(), Json()} : IntervalJson(ratios.interval)},
          {"hodges_lehmann", ratios.typical ? Number(ratios.typical->estimate) : Json()},
          {"hodges_lehmann_interval", ratios.typical ? IntervalJson(ratios.typical->interval) : Json()},
          {"hodges_lehmann_coverage", ratios.typical ? Number(ratios.typical->coverage) : Json()},
          {"lower", ratios.lower},
          {"equal", ratios.test.zeros},
          {"wilcoxon_positive_sum", ratios.test.positive_sum},
          {"wilcoxon_negative_sum", ratios.test.negative_sum},
          {"wilcoxon_exact", ratios.test.exact},
          {"wilcoxon_p", tested(ratios.test.two_sided_p)},
          {"adjusted_p", tested(ratios.adjusted_p)},
          {"change", ToString(ratios.change)}};
}

Json IdenticalWorkJson(const std::vector<IdenticalWork>& identical) {
  auto json = Json::array();
  for (const IdenticalWork& work : identical) {
    json.push_back({{"task", ToString(work.column.task)},
                    {"initialization", ToString(work.column.initialization)},
                    {"method", MethodJson(work.method)},
                    {"copy", MethodJson(work.copy)},
                    {"n", work.time.n},
                    {"time_ratio", Number(work.time.mean)},
                    {"interval", IntervalJson(work.time.interval)},
                    {"margin", Number(work.Margin())}});
  }
  return json;
}

Json ProblemsJson(const std::vector<ProblemRatio>& ratios) {
  auto json = Json::array();
  for (const ProblemRatio& ratio : ratios) {
    json.push_back(
        {{"problem", ratio.problem}, {"job_a", ratio.job_a}, {"job_b", ratio.job_b}, {"time_ratio", ratio.ratio}});
  }
  return json;
}

const char* DominanceWord(statistics::Dominance dominance) {
  constexpr std::array kWord = {"equal", "a", "b", "crossing"};
  return kWord.at(static_cast<std::size_t>(dominance));
}

Json CellJson(const CellComparison& cell) {
  const statistics::PairCounts& counts = cell.success.counts;
  return {{"task", ToString(cell.column.task)},
          {"initialization", ToString(cell.column.initialization)},
          {"method_a", MethodJson(cell.a)},
          {"method_b", MethodJson(cell.b)},
          {"change", ToString(cell.change)},
          {"pairs", counts.pairs()},
          {"both", counts.both},
          {"only_a", counts.only_first},
          {"only_b", counts.only_second},
          {"neither", counts.neither},
          {"missing", counts.missing},
          {"without_partner_a", cell.only_in_a},
          {"without_partner_b", cell.only_in_b},
          {"limit_ms", cell.limit_ms},
          {"contended_share", cell.contended_share},
          {"success", SuccessJson(cell.success)},
          {"work", RatioJson(cell.work)},
          {"time", RatioJson(cell.time)},
          {"time_margin", Number(cell.time_margin)},
          {"cost", RatioJson(cell.cost)},
          {"charge_ms", cell.charge.ms},
          {"charge_rule", EnumNameOf(cell.charge.rule)},
          {"par10_a_ms", cell.par10_a_ms},
          {"par10_b_ms", cell.par10_b_ms},
          {"par10_ratio_interval", IntervalJson(cell.par10_ratio)},
          {"runtimes", DominanceWord(cell.dominance)},
          {"crossing_ms", cell.crossing_ms ? Json(*cell.crossing_ms) : Json()},
          {"fastest", ProblemsJson(cell.fastest)},
          {"slowest", ProblemsJson(cell.slowest)}};
}

// Adds the figures of a member; names of nested ones are joined: success_share_a, time_interval_lower.
void AddFigures(const std::string& name, const Json& value, Listing* listing) {
  if (value.is_object()) {
    for (const auto& [key, member] : value.items()) AddFigures(name + "_" + key, member, listing);
  } else if (name.ends_with("interval")) {
    AddFigures(name + "_lower", value.is_null() ? Json() : value.at(0), listing);
    AddFigures(name + "_upper", value.is_null() ? Json() : value.at(1), listing);
  } else if (!value.is_array()) {  // the extreme problems are lists
    if (listing->rows.size() == 1) listing->columns.push_back(name);
    listing->rows.back().push_back(value);
  }
}

// Returns one row per comparison, with all its figures.
Listing Unrounded(const Comparison& comparison) {
  Listing listing;
  for (const CellComparison& cell : comparison.cells) {
    listing.rows.emplace_back();
    const Json figures = CellJson(cell);
    for (const auto& [key, value] : figures.items()) AddFigures(key, value, &listing);
  }
  return listing;
}

// Returns a table with one row per comparison and all its figures, unrounded, below the title of TableOf.
Table RowsOf(const Comparison& comparison, const TimeUnit& unit) {
  Table rows = TableOf(Unrounded(comparison));
  const Table text = TableOf(comparison, unit);
  rows.title = text.title;
  rows.notes = text.notes;
  return rows;
}

}  // namespace

std::string DescribePairs(const statistics::PairCounts& counts) {
  return std::to_string(counts.pairs()) + ": both " + std::to_string(counts.both) + ", only A " +
         std::to_string(counts.only_first) + ", only B " + std::to_string(counts.only_second) + ", neither " +
         std::to_string(counts.neither) + (counts.missing > 0 ? "; missing " + std::to_string(counts.missing) : "");
}

std::string TitleOf(const Comparison& comparison, const CellComparison& cell) {
  const MethodIdentity* method = DistinguishingMethod(comparison, cell);
  return (method != nullptr ? NameOf(*method) + ": " : "") + ColumnTitle(cell.column) + ": " + Verdict(cell);
}

std::string DescribeComparison(const Comparison& comparison) {
  std::string text = "Dataset " + comparison.dataset + ", " + std::string(ToString(comparison.rule)) + " rule. ";
  const std::string a = DescribeOrigins(comparison.a.origins), b = DescribeOrigins(comparison.b.origins);
  if (a == b) return text + a;
  return text + "A: " + a + " B: " + b;
}

nlohmann::ordered_json ComparisonJson(const Comparison& comparison) {
  const auto side = [](const ComparedSide& compared) {
    return Json{{"title", compared.title},
                {"experiment_id", compared.experiment_id},
                {"taken_over", compared.taken_over},
                {"origins", OriginsJson(compared.origins)}};
  };
  Json json = {{"a", side(comparison.a)},
               {"b", side(comparison.b)},
               {"dataset", comparison.dataset},
               {"rule", ToString(comparison.rule)},
               {"margin", comparison.options.margin},
               {"family", comparison.options.family},
               {"interval_level", comparison.options.level()},
               {"bootstrap_seed", comparison.options.seed},
               {"change", ToString(comparison.change)},
               {"least_discordant", MinDiscordantPairs()},
               {"notes", comparison.notes},
               {"identical_work", IdenticalWorkJson(comparison.identical_work)}};
  json["comparisons"] = Json::array();
  for (const CellComparison& cell : comparison.cells) json["comparisons"].push_back(CellJson(cell));
  return json;
}

Table TableOf(const Comparison& comparison, const TimeUnit& unit) {
  Table table;
  table.title = {"A: " + comparison.a.title, "B: " + comparison.b.title, DescribeComparison(comparison)};
  table.has_headings = false;
  table.columns = {{"figure", "", "", Alignment::kLeft}, {"B beside A", "", "", Alignment::kLeft}};
  for (const CellComparison& cell : comparison.cells) {
    const Emphasis emphasis = cell.change == ComparisonResult::kWorse ? Emphasis::kBad : Emphasis::kBest;
    for (const Line& line : LinesOf(cell, unit)) {
      table.rows.push_back({{TextCell(line[0]), TextCell(line[1])}, TitleOf(comparison, cell), emphasis});
    }
  }
  for (const IdenticalWork& work : comparison.identical_work) table.notes.push_back({IdenticalWorkText(work)});
  for (const std::string& note : comparison.notes) table.notes.push_back({"Note: " + note});
  table.notes.push_back({RuleText(comparison)});
  table.notes.push_back({Summary(comparison), Emphasis::kBest});
  return table;
}

std::string RenderComparison(const Comparison& comparison, TableFormat format, const TableStyle& style) {
  if (format == TableFormat::kJson && style.columns.empty()) return JsonText(ComparisonJson(comparison)) + "\n";
  const bool one_row_each = IsExact(format) || !style.columns.empty();
  const Table all = one_row_each ? RowsOf(comparison, style.time_unit) : TableOf(comparison, style.time_unit);
  return RenderTable(KeepColumns(all, style.columns), format, style.layout);
}

}  // namespace legopt::client
