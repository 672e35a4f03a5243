#include "legopt/worldgen/internal/stance_sampler.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>

#include "legopt/judge/judge.h"
#include "legopt/judge/solution_file.h"
#include "legopt/math/parallel.h"
#include "legopt/math/random_numbers.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/types/input_error.h"
#include "legopt/worldgen/internal/seeds.h"
#include "legopt/worldgen/internal/stance_candidates.h"
#include "legopt/worldgen/internal/stance_refusal.h"
#include "legopt/worldgen/internal/walkable_area.h"

namespace legopt::worldgen {
namespace {

using Eigen::Vector3d;

/// Candidates for robots with two feet.
class PairCandidates : public StanceCandidates {
 public:
  PairCandidates(const std::shared_ptr<const ProbeModel>& model, const WalkableArea& area,
                 const StanceSamplerOptions& options)
      : probe_(model), area_(area), options_(options) {
    if (options.prove) prover_.emplace(model->dataset);
  }

  Candidate Try(std::int64_t number) override {
    std::mt19937_64 generator(DeriveSeed(options_.seed, "stance/" + std::to_string(number)));
    Candidate candidate;
    const std::optional<ContactTarget> first = FirstFoot(generator);
    if (!first) return candidate;
    candidate.fate = Fate::kSecondFoot;
    for (int k = 0; k < options_.second_foot_tries; ++k) {
      const std::optional<ContactTarget> second = SecondFoot(*first, generator);
      if (!second) continue;
      candidate.stance.contacts = {*first, *second};
      if (probe_.TrunkDistance(candidate.stance, kTrunkMargin) < kTrunkMargin) {
        candidate.fate = Fate::kTrunk;
        continue;
      }
      candidate.fate = Fate::kStance;
      if (!prover_) return candidate;
      PostureProof proof = prover_->Prove(candidate.stance, 0);
      if (proof.accepted) return candidate;
      candidate.fate = Fate::kInfeasible;
      candidate.obstacle = std::move(proof.failure);
      return candidate;
    }
    return candidate;
  }

 private:
  static constexpr double kTrunkMargin = 1e-3;  // m

  std::optional<ContactTarget> FirstFoot(std::mt19937_64& generator) {
    const auto [point, triangle] = area_.Sample(generator);
    const double yaw = M_PI * (2.0 * UniformRandom(generator) - 1.0);
    if (!options_.region.isEmpty() && !options_.region.contains(Eigen::Vector2d(point.head<2>()))) return {};
    ContactTarget foothold = probe_.Place(0, point, probe_.model().terrain.normal(triangle), yaw);
    if (!probe_.Holds(0, foothold)) return {};
    return foothold;
  }

  std::optional<ContactTarget> SecondFoot(const ContactTarget& first, std::mt19937_64& generator) {
    constexpr double kTurn_rad = M_PI / 6.0;
    const ProbeOptions& options = probe_.model().options;
    const double radius = options.reach_m * std::sqrt(UniformRandom(generator));
    const double angle = 2.0 * M_PI * UniformRandom(generator);
    const double yaw = Yaw(first) + kTurn_rad * (2.0 * UniformRandom(generator) - 1.0);
    const Eigen::Vector2d at = first.position.head<2>() + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    probe_.Footholds(1, at.x(), at.y(), yaw, footholds_);
    for (const ContactTarget& foothold : footholds_) {
      if (std::abs(foothold.position.z() - first.position.z()) <= options.step_m) return foothold;
    }
    return {};
  }

  StanceProbe probe_;
  std::optional<PostureProver> prover_;
  const WalkableArea& area_;
  const StanceSamplerOptions& options_;
  std::vector<ContactTarget> footholds_;
};

/// Sampling in progress.
class Sampling {
 public:
  Sampling(const ProbeModel& model, const StanceSamplerOptions& options) : model_(model), options_(options) {
    result_.tally.two_feet = !model.reach;
  }

  bool done() const { return std::ssize(result_.stances) == options_.count; }
  int found() const { return static_cast<int>(result_.stances.size()); }
  SampledStances TakeResult() { return std::move(result_); }

  void Add(Candidate candidate) {
    constexpr std::ptrdiff_t kKept = 8;
    SamplingStatistics& tally = result_.tally;
    ++tally.candidates;
    tally.first_foot += candidate.fate == Fate::kFirstFoot ? 1 : 0;
    tally.second_foot += candidate.fate == Fate::kSecondFoot ? 1 : 0;
    tally.trunk += candidate.fate == Fate::kTrunk ? 1 : 0;
    tally.infeasible += candidate.fate == Fate::kInfeasible ? 1 : 0;
    if (candidate.fate == Fate::kStance) result_.stances.push_back(std::move(candidate.stance));
    if (candidate.fate != Fate::kInfeasible) return;
    ++obstacles_[candidate.obstacle];
    if (std::ssize(infeasible_) < kKept) infeasible_.push_back(std::move(candidate.stance));
  }

  /// Throws if no stance is found and one cause has rejected many candidates.
  void RefuseIfHopeless() const {
    const SamplingStatistics& tally = result_.tally;
    if (!result_.stances.empty()) return;
    const std::int64_t rejected = std::max({tally.first_foot, tally.second_foot, tally.trunk});
    if (tally.infeasible >= options_.max_infeasible || rejected >= options_.max_rejected) Refuse();
  }
  [[noreturn]] void Refuse() const {
    RefuseStances(model_, {.found = found(),
                           .wanted = options_.count,
                           .tally = result_.tally,
                           .obstacles = obstacles_,
                           .infeasible = infeasible_});
  }

 private:
  const ProbeModel& model_;
  const StanceSamplerOptions& options_;
  SampledStances result_;
  std::map<std::string, int> obstacles_;
  std::vector<Stance> infeasible_;  ///< the first ones
};

std::unique_ptr<StanceCandidates> MakeCandidates(const std::shared_ptr<const ProbeModel>& model,
                                                 const WalkableArea& area, const StanceSamplerOptions& options) {
  if (model->reach) return MakeLeggedCandidates(model, area, options);
  return std::make_unique<PairCandidates>(model, area, options);
}

}  // namespace

std::string SamplingStatistics::Describe() const {
  return std::to_string(candidates) +
         (two_feet ? " candidates: first foot cannot stand " : " candidates: a foot cannot stand ") +
         std::to_string(first_foot) + (two_feet ? ", no second foot " : ", feet not within reach ") +
         std::to_string(second_foot) + ", trunk in collision " + std::to_string(trunk) + ", no posture " +
         std::to_string(infeasible);
}

struct PostureProver::Impl {
  explicit Impl(const std::shared_ptr<const Dataset>& dataset) : solver(dataset), judge(dataset) {
    method.name = method_name();
    method.multi_starts = 10;
  }
  ProblemSolver solver;
  Judge judge;
  Method method;
};

PostureProver::PostureProver(const std::shared_ptr<const Dataset>& dataset) : impl_(std::make_unique<Impl>(dataset)) {}
PostureProver::~PostureProver() = default;
PostureProver::PostureProver(PostureProver&&) noexcept = default;

const char* PostureProver::method_name() { return "SQP(Multistart10)"; }

namespace {

/// Returns the first check that fails by the literal and strict rules, with its subject.
std::string FailureOf(const Evaluation& evaluation) {
  const Verdict check = evaluation.literal != Verdict::kSuccess ? evaluation.literal : evaluation.strict;
  std::string text(DescriptionOf(check).name);
  const auto found = std::find_if(evaluation.violations.begin(), evaluation.violations.end(),
                                  [&](const Violation& violation) { return violation.check == check; });
  if (found != evaluation.violations.end() && !found->subject.empty()) text += " of " + found->subject;
  return text;
}

}  // namespace

PostureProof PostureProver::Prove(const Stance& stance, int id) {
  const ProblemDefinition problem{.id = id, .stances = {stance}};
  const SolveOutcome outcome =
      impl_->solver.Solve(kStanceTask, problem, Initialization::kGood, impl_->method, SolveSettings{});
  PostureProof proof;
  proof.failure = "the solver: no point";
  if (outcome.waypoints.size() != 1) return proof;
  const Evaluation evaluation = impl_->judge.Evaluate(kStanceTask, problem, outcome.waypoints);
  proof.accepted = evaluation.literal == Verdict::kSuccess && evaluation.strict == Verdict::kSuccess;
  proof.failure = proof.accepted ? "" : FailureOf(evaluation);
  proof.x = outcome.waypoints.front();
  proof.cost = evaluation.cost;
  constexpr double kMicros = 1e-6;
  proof.time_s = kMicros * static_cast<double>(outcome.wall_us);
  return proof;
}

SampledStances SampleStances(const std::shared_ptr<const ProbeModel>& model, const StanceSamplerOptions& options,
                             const std::function<void(int, int)>& progress) {
  const WalkableArea area(*model, options.region);
  if (area.empty()) {
    throw InputError({model->dataset->folder().string(), "stances", "0", "there is no walkable ground in the region",
                      "check the scene's walkable ground, the radius and the slope"});
  }
  std::vector<std::unique_ptr<StanceCandidates>> candidates;
  for (int k = 0; k < options.threads; ++k) candidates.push_back(MakeCandidates(model, area, options));
  Sampling sampling(*model, options);
  constexpr size_t kBatch = 64;
  for (std::int64_t first = 0; first < options.max_candidates; first += kBatch) {
    std::vector<Candidate> batch(kBatch);
    ForEachIndex(options.threads, kBatch, [&](int worker, size_t i) {
      batch[i] = candidates[static_cast<size_t>(worker)]->Try(first + static_cast<std::int64_t>(i));
    });
    for (Candidate& candidate : batch) {
      if (!sampling.done()) sampling.Add(std::move(candidate));
    }
    if (progress) progress(sampling.found(), options.count);
    if (sampling.done()) return sampling.TakeResult();
    sampling.RefuseIfHopeless();
  }
  sampling.Refuse();
}

namespace {

/// Plans walk on feet: throws InputError for other contacts, and for what a stance string cannot express.
void RequireFeet(const Dataset& dataset, const Stance& stance, const std::filesystem::path& path, int id) {
  for (const ContactTarget& target : stance.contacts) {
    const bool is_foot = std::ranges::find(dataset.feet(), target.contact, &Contact::name) != dataset.feet().end();
    if (is_foot && stance.only_poses()) continue;
    throw InputError({path.string(), "problem " + std::to_string(id), target.contact,
                      is_foot ? "the stance has more than poses" : "is no foot on which plans walk",
                      "leave this problem out"});
  }
}

}  // namespace

std::vector<Stance> ReadFeasibleStances(const std::shared_ptr<const Dataset>& dataset,
                                        const std::filesystem::path& path) {
  const SolutionFile file = ReadSolutions(path);
  Judge judge(dataset);
  const auto accepted = [&judge](const ProblemDefinition& problem, const Solution& solution) {
    const Evaluation evaluation = judge.Evaluate(kStanceTask, problem, solution.waypoints);
    return evaluation.literal == Verdict::kSuccess && evaluation.strict == Verdict::kSuccess;
  };
  std::vector<Stance> stances;
  std::set<std::string> known;
  const std::string word(ToString(kStanceTask));
  for (const SolvedProblem& problem : file.problems) {
    const ProblemDefinition& definition = problem.definition;
    if (!Fits(kStanceTask, definition)) {
      throw InputError({path.string(), "problem " + std::to_string(definition.id),
                        std::to_string(definition.stances.size()) + " stances", "is no " + word + " problem",
                        "export the solutions with --task " + word});
    }
    RequireFeet(*dataset, definition.stances.front(), path, definition.id);
    const bool proven = std::any_of(problem.solutions.begin(), problem.solutions.end(),
                                    [&](const Solution& solution) { return accepted(definition, solution); });
    if (proven && known.insert(StanceKey(definition.stances.front())).second) {
      stances.push_back(definition.stances.front());
    }
  }
  if (stances.empty()) {
    throw InputError({path.string(), "problems", std::to_string(file.problems.size()),
                      "no stance has a solution that the judge accepts",
                      "check that the solutions were made with this dataset"});
  }
  return stances;
}

}  // namespace legopt::worldgen
