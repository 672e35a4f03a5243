#include "legopt/worldgen/internal/pair_planner.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>

#include "legopt/dataset/internal/text_file.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/input/json.h"
#include "legopt/math/parallel.h"
#include "legopt/math/random_numbers.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"
#include "legopt/worldgen/internal/legged_planner.h"
#include "legopt/worldgen/internal/seeds.h"

namespace legopt::worldgen {
namespace {

using Json = nlohmann::json;

constexpr int kBatch = 8;
constexpr int kHopelessPairs = 16;  // limit of pairs without any plan, for more than two feet

double MeanHeight(const Stance& stance) {
  double sum = 0.0;
  for (const ContactTarget& foothold : stance.contacts) sum += foothold.position.z();
  return sum / static_cast<double>(stance.contacts.size());
}

bool IsPair(const Stance& a, const Stance& b, FloorChange change, const PairOptions& options) {
  const double height_m = std::abs(MeanHeight(a) - MeanHeight(b));
  return change == FloorChange::kSame ? height_m <= options.same_m : height_m >= options.different_m;
}

/// Draws a random pair of stances; empty if a thousand tries give none of the requested kind.
std::optional<PlannedPair> SamplePair(const std::vector<Stance>& stances, FloorChange change,
                                      const PairOptions& options, int number) {
  std::mt19937_64 generator(
      DeriveSeed(options.seed, "pair/" + std::string(ToString(change)) + "/" + std::to_string(number)));
  constexpr int kTries = 1000;
  const auto draw = [&] { return static_cast<int>(UniformRandom(generator) * static_cast<double>(stances.size())); };
  for (int k = 0; k < kTries; ++k) {
    const int a = draw();
    const int b = draw();
    const bool fits = IsPair(stances[static_cast<size_t>(a)], stances[static_cast<size_t>(b)], change, options);
    if (a != b && fits) return PlannedPair{.pair = number, .start = a, .goal = b, .plan = {}};
  }
  return {};
}

Json ToJson(const PlannedPair& pair) {
  Json stances = Json::array();
  for (const Stance& stance : pair.plan.stances) stances.push_back(FormatStance(stance));
  return {{"pair", pair.pair},
          {"start", pair.start},
          {"goal", pair.goal},
          {"steps", pair.plan.steps},
          {"cost", pair.plan.cost},
          {"bound", pair.plan.bound},
          {"expansions", pair.plan.expansions},
          {"counts", pair.counts},
          {"stances", stances}};
}

std::vector<PlannedPair> ReadState(const std::filesystem::path& path) {
  std::vector<PlannedPair> pairs;
  if (!std::filesystem::exists(path)) return pairs;
  for (const Json& entry : ReadJsonFile(path)) {
    PlannedPair& pair = pairs.emplace_back();
    entry.at("pair").get_to(pair.pair);
    entry.at("start").get_to(pair.start);
    entry.at("goal").get_to(pair.goal);
    entry.at("steps").get_to(pair.plan.steps);
    entry.at("cost").get_to(pair.plan.cost);
    entry.at("bound").get_to(pair.plan.bound);
    entry.at("expansions").get_to(pair.plan.expansions);
    entry.at("counts").get_to(pair.counts);
    for (const Json& stance : entry.at("stances")) {
      pair.plan.stances.push_back(ParseStance(stance.get<std::string>(), {path.string(), "plan"}));
    }
  }
  return pairs;
}

int CountAccepted(std::span<const PlannedPair> pairs) {
  return static_cast<int>(std::count_if(pairs.begin(), pairs.end(), [](const auto& pair) { return pair.counts; }));
}

/// Removes pairs from an earlier call that wanted more plans.
void RemoveSurplusPairs(int wanted, std::vector<PlannedPair>* pairs) {
  size_t size = 0;
  for (int count = 0; size < pairs->size() && count < wanted; size += kBatch) {
    count += CountAccepted(std::span(*pairs).subspan(size, std::min<size_t>(kBatch, pairs->size() - size)));
  }
  pairs->resize(std::min(size, pairs->size()));
}

[[noreturn]] void Refuse(FloorChange change, const std::string& value, const std::string& message) {
  throw InputError({"footstep plans", std::string(ToString(change)) + " floor", value, message,
                    "ask for fewer plans, for more stances, or use another seed or scene"});
}

/// Throws InputError if the legs of a robot with many feet have no stride.
void RequireStride(const ProbeModel& model) {
  constexpr double kLeastShare = 0.04;
  const ReachCloud& reach = *model.reach;
  if (reach.stride_m() >= kLeastShare * reach.height_m()) return;
  const std::string& foot = model.dataset->feet()[static_cast<size_t>(reach.limiting_contact())].name;
  throw InputError({(model.dataset->folder() / kDatasetFileName).string(), "nominal_posture",
                    FormatFixed(reach.stride_m(), 3) + " m",
                    "the feet cannot walk: " + foot +
                        " cannot move to all sides of its nominal place on level ground, at any height of the trunk",
                    "check the joint limits of this leg, and choose a nominal posture in the middle of its reach, then "
                    "run 'legopt dataset hash'"});
}

/// Reports that a robot with many feet found no plan, the most frequent reason for the first pair, and the foot with
/// the shortest stride. `planner`: planner of that search.
[[noreturn]] void RefuseLegs(const ProbeModel& model, const LeggedPlanner& planner, FloorChange change, int pairs) {
  const ReachCloud& reach = *model.reach;
  std::string reason = planner.MainRefusal();
  if (!reason.empty()) reason = "; of the first pair, most often: " + reason;
  const std::string& foot = model.dataset->feet()[static_cast<size_t>(reach.limiting_contact())].name;
  throw InputError({"footstep plans", std::string(ToString(change)) + " floor", "0 plans",
                    "no plan between " + std::to_string(pairs) + " pairs of stances" + reason +
                        "; the shortest stride is that of " + foot + ": " + FormatFixed(reach.stride_m(), 3) +
                        " m to all sides of its nominal place",
                    "check the joint limits of this leg and the nominal posture; or use another seed or scene"});
}

/// Plans between two stances; a workspace of one thread.
using Planner = std::function<std::optional<FootstepPlan>(const Stance& start, const Stance& goal)>;

Planner MakePlanner(const std::shared_ptr<const ProbeModel>& model, const std::shared_ptr<const GuideMap>& guide,
                    const PlannerOptions& options) {
  if (model->reach) {
    const auto planner = std::make_shared<LeggedPlanner>(model, guide, options);
    return [planner](const Stance& start, const Stance& goal) { return planner->Plan(start, goal); };
  }
  const auto planner = std::make_shared<FootstepPlanner>(model, guide, options);
  return [planner](const Stance& start, const Stance& goal) { return planner->Plan(start, goal); };
}

}  // namespace

std::string_view ToString(FloorChange change) { return change == FloorChange::kSame ? "same" : "different"; }

bool HasPair(const std::vector<Stance>& stances, FloorChange change, const PairOptions& options) {
  for (size_t a = 0; a < stances.size(); ++a) {
    for (size_t b = 0; b < a; ++b) {
      if (IsPair(stances[a], stances[b], change, options)) return true;
    }
  }
  return false;
}

std::vector<PlannedPair> PlanPairs(const std::shared_ptr<const ProbeModel>& model,
                                   const std::shared_ptr<const GuideMap>& guide, const PlannerOptions& planner_options,
                                   const std::vector<Stance>& stances, FloorChange change, const PairOptions& options,
                                   const std::filesystem::path& state_file,
                                   const std::function<void(int, int)>& progress) {
  std::vector<PlannedPair> pairs = ReadState(state_file);
  RemoveSurplusPairs(options.wanted, &pairs);
  if (model->reach) RequireStride(*model);
  const int most_pairs = model->reach ? std::min(options.max_pairs, kHopelessPairs) : options.max_pairs;
  std::vector<Planner> planners;
  for (int k = 0; k < options.threads; ++k) planners.push_back(MakePlanner(model, guide, planner_options));
  while (CountAccepted(pairs) < options.wanted) {
    const int first = static_cast<int>(pairs.size());
    if (first >= most_pairs && CountAccepted(pairs) == 0 && model->reach) {
      LeggedPlanner planner(model, guide, planner_options);  // a fresh one, for any number of threads
      planner.Plan(stances[static_cast<size_t>(pairs.front().start)], stances[static_cast<size_t>(pairs.front().goal)]);
      RefuseLegs(*model, planner, change, first);
    }
    if (first >= options.max_pairs) {
      Refuse(change, std::to_string(CountAccepted(pairs)) + " of " + std::to_string(options.wanted),
             "not enough plans" + std::string(options.counts ? " that are wanted" : "") + " between " +
                 std::to_string(first) + " pairs of stances");
    }
    std::vector<PlannedPair> batch(kBatch);
    for (int k = 0; k < kBatch; ++k) {
      const std::optional<PlannedPair> pair = SamplePair(stances, change, options, first + k);
      if (!pair) Refuse(change, std::to_string(stances.size()) + " stances", "no two of them are such a pair");
      batch[static_cast<size_t>(k)] = *pair;
    }
    ForEachIndex(options.threads, batch.size(), [&](int worker, size_t i) {
      std::optional<FootstepPlan> plan = planners[static_cast<size_t>(worker)](
          stances[static_cast<size_t>(batch[i].start)], stances[static_cast<size_t>(batch[i].goal)]);
      if (!plan) return;
      batch[i].plan = std::move(*plan);
      batch[i].counts = !options.counts || options.counts(worker, batch[i].plan);
    });
    std::move(batch.begin(), batch.end(), std::back_inserter(pairs));
    Json state = Json::array();
    for (const PlannedPair& pair : pairs) state.push_back(ToJson(pair));
    WriteTextFile(state_file, Dump(state) + "\n");
    if (progress) progress(std::min(CountAccepted(pairs), options.wanted), options.wanted);
  }
  return pairs;
}

}  // namespace legopt::worldgen
