#include "legopt/worldgen/internal/stance_sampler.h"

#include <algorithm>
#include <cmath>
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

namespace legopt::worldgen {
namespace {

using Eigen::Vector3d;

/// Triangles flat enough to stand on, with cumulative areas.
class AreaTable {
 public:
  AreaTable(const ProbeModel& model, const Eigen::AlignedBox2d& region) : terrain_(model.terrain) {
    const double least_nz = std::cos(model.options.slope_rad);
    double sum = 0.0;
    for (size_t t = 0; t < terrain_.mesh().triangles.size(); ++t) {
      const int triangle = static_cast<int>(t);
      if (terrain_.normal(triangle).z() < least_nz) continue;
      Eigen::AlignedBox2d box;
      for (const int corner : terrain_.mesh().triangles[t]) {
        box.extend(Eigen::Vector2d(terrain_.mesh().vertices[static_cast<size_t>(corner)].head<2>()));
      }
      if (!region.isEmpty() && !region.intersects(box)) continue;
      sum += terrain_.area_m2(triangle);
      triangles_.push_back(triangle);
      sums_.push_back(sum);
    }
  }

  bool empty() const { return triangles_.empty(); }

  /// Returns a random point, uniform by area, and its triangle.
  std::pair<Vector3d, int> Draw(std::mt19937_64& generator) const {
    const double target = UniformRandom(generator) * sums_.back();
    const auto found = std::min<std::ptrdiff_t>(std::upper_bound(sums_.begin(), sums_.end(), target) - sums_.begin(),
                                                std::ssize(sums_) - 1);
    const int triangle = triangles_[static_cast<size_t>(found)];
    const double root = std::sqrt(UniformRandom(generator));
    const double share = UniformRandom(generator);
    const auto& corners = terrain_.mesh().triangles[static_cast<size_t>(triangle)];
    const auto at = [&](size_t k) { return terrain_.mesh().vertices[static_cast<size_t>(corners[k])]; };
    return {(1.0 - root) * at(0) + root * (1.0 - share) * at(1) + root * share * at(2), triangle};
  }

 private:
  const Terrain& terrain_;
  std::vector<int> triangles_;
  std::vector<double> sums_;
};

enum class Fate { kFirstFoot, kSecondFoot, kTrunk, kInfeasible, kStance };

struct Candidate {
  Fate fate = Fate::kFirstFoot;
  Stance stance;
};

/// Generates and tests candidates; one per thread.
class Sampler {
 public:
  Sampler(const std::shared_ptr<const ProbeModel>& model, const AreaTable& areas, const StanceSamplerOptions& options)
      : probe_(model), areas_(areas), options_(options) {
    if (options.prove) prover_.emplace(model->dataset);
  }

  Candidate Try(std::int64_t number) {
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
      const bool proven = !prover_ || prover_->Prove(candidate.stance, 0).accepted;
      candidate.fate = proven ? Fate::kStance : Fate::kInfeasible;
      return candidate;
    }
    return candidate;
  }

 private:
  static constexpr double kTrunkMargin = 1e-3;  // m

  std::optional<ContactTarget> FirstFoot(std::mt19937_64& generator) {
    const auto [point, triangle] = areas_.Draw(generator);
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
  const AreaTable& areas_;
  const StanceSamplerOptions& options_;
  std::vector<ContactTarget> footholds_;
};

void Count(const Candidate& candidate, SamplingStatistics& tally) {
  ++tally.candidates;
  tally.first_foot += candidate.fate == Fate::kFirstFoot ? 1 : 0;
  tally.second_foot += candidate.fate == Fate::kSecondFoot ? 1 : 0;
  tally.trunk += candidate.fate == Fate::kTrunk ? 1 : 0;
  tally.infeasible += candidate.fate == Fate::kInfeasible ? 1 : 0;
}

[[noreturn]] void RefuseScene(const ProbeModel& model, const std::string& found, const std::string& why) {
  throw InputError({model.dataset->folder().string(), "stances", found, why,
                    "check the scene's walkable ground, the radius and the slope"});
}

}  // namespace

std::string SamplingStatistics::Describe() const {
  return std::to_string(candidates) + " candidates: first foot cannot stand " + std::to_string(first_foot) +
         ", no second foot " + std::to_string(second_foot) + ", trunk in collision " + std::to_string(trunk) +
         ", no posture " + std::to_string(infeasible);
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

PostureProof PostureProver::Prove(const Stance& stance, int id) {
  const ProblemDefinition problem{.id = id, .stances = {stance}};
  const SolveOutcome outcome =
      impl_->solver.Solve(kStanceTask, problem, Initialization::kGood, impl_->method, SolveSettings{});
  PostureProof proof;
  if (outcome.waypoints.size() != 1) return proof;
  const Evaluation evaluation = impl_->judge.Evaluate(kStanceTask, problem, outcome.waypoints);
  proof.accepted = evaluation.literal == Verdict::kSuccess && evaluation.strict == Verdict::kSuccess;
  proof.x = outcome.waypoints.front();
  proof.cost = evaluation.cost;
  constexpr double kMicros = 1e-6;
  proof.time_s = kMicros * static_cast<double>(outcome.wall_us);
  return proof;
}

SampledStances SampleStances(const std::shared_ptr<const ProbeModel>& model, const StanceSamplerOptions& options,
                             const std::function<void(int, int)>& progress) {
  const AreaTable areas(*model, options.region);
  if (areas.empty()) RefuseScene(*model, "0", "there is no walkable ground in the region");
  std::vector<std::unique_ptr<Sampler>> samplers;
  for (int k = 0; k < options.threads; ++k) samplers.push_back(std::make_unique<Sampler>(model, areas, options));
  SampledStances result;
  constexpr size_t kBatch = 64;
  for (std::int64_t first = 0; first < options.max_candidates; first += kBatch) {
    std::vector<Candidate> batch(kBatch);
    ForEachIndex(options.threads, kBatch, [&](int worker, size_t i) {
      batch[i] = samplers[static_cast<size_t>(worker)]->Try(first + static_cast<std::int64_t>(i));
    });
    for (Candidate& candidate : batch) {
      Count(candidate, result.tally);
      if (candidate.fate != Fate::kStance) continue;
      result.stances.push_back(std::move(candidate.stance));
      if (std::ssize(result.stances) == options.count) break;
    }
    if (progress) progress(static_cast<int>(result.stances.size()), options.count);
    if (std::ssize(result.stances) == options.count) return result;
  }
  RefuseScene(*model, std::to_string(result.stances.size()) + " of " + std::to_string(options.count),
              "not enough stances found; " + result.tally.Describe());
}

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
    const bool proven = std::any_of(problem.solutions.begin(), problem.solutions.end(),
                                    [&](const Solution& solution) { return accepted(definition, solution); });
    if (proven && known.insert(FormatStance(definition.stances.front())).second) {
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
