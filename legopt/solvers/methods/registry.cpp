#include "legopt/solvers/methods/registry.h"

#include "legopt/solvers/best_solver.h"
#include "legopt/solvers/chomp_solver.h"
#include "legopt/solvers/cma_es_solver.h"
#include "legopt/solvers/gradient_solver.h"
#include "legopt/solvers/ipopt_solver.h"
#include "legopt/solvers/sqp_solver.h"
#include "legopt/solvers/stomp_solver.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"

namespace legopt {
namespace {

// Linear models use obstacles ahead; plain penalties are zero until the margin (5e-4) is violated.
constexpr double kAhead_m = 0.03;
constexpr double kTouching_m = 1e-3;

auto Descent(const GradientOptions& options, std::unique_ptr<GradientDirection> direction, const Sampling& sampling) {
  return std::make_unique<GradientSolver>(options, std::move(direction), sampling);
}

auto MomentDescent(const MomentGradientOptions& options, bool nesterov, const Sampling& sampling) {
  return Descent(options.gradient, std::make_unique<MomentDirection>(options.moments, nesterov), sampling);
}

}  // namespace

SolverRegistry::SolverRegistry() {
  Register<SqpOptions>({.word = "sqp", .paper_name = "SQP", .samples = true, .contact_range_m = kAhead_m},
                       [](const auto& o, const Sampling& s) { return std::make_unique<SqpSolver>(o, s); });
  Register<BestOptions>(
      {.word = "best", .paper_name = "LegOpt-best", .is_stochastic = true, .contact_range_m = kAhead_m},
      [](const auto& o, const Sampling&) { return std::make_unique<BestSolver>(o); });
  Register<IpoptOptions>({.word = "ipopt", .paper_name = "Ipopt", .contact_range_m = kAhead_m},
                         [](const auto& o, const Sampling&) { return std::make_unique<IpoptSolver>(o); });
  Register<GradientOptions>(
      {.word = "sgd", .paper_name = "SGD", .samples = true, .contact_range_m = kTouching_m},
      [](const auto& o, const Sampling& s) { return Descent(o, std::make_unique<SteepestDirection>(), s); });
  Register<MomentGradientOptions>(
      {.word = "adam", .paper_name = "Adam", .samples = true, .contact_range_m = kTouching_m},
      [](const auto& o, const Sampling& s) { return MomentDescent(o, false, s); });
  Register<MomentGradientOptions>(
      {.word = "nadam", .paper_name = "Nadam", .samples = true, .contact_range_m = kTouching_m},
      [](const auto& o, const Sampling& s) { return MomentDescent(o, true, s); });
  Register<ChompOptions>({.word = "chomp", .paper_name = "CHOMP", .contact_range_m = kTouching_m},
                         [](const auto& o, const Sampling&) { return std::make_unique<ChompSolver>(o); });
  Register<StompOptions>(
      {.word = "stomp", .paper_name = "STOMP", .is_stochastic = true, .contact_range_m = kTouching_m},
      [](const auto& o, const Sampling&) { return std::make_unique<StompSolver>(o); });
  Register<CmaEsOptions>(
      {.word = "cma_es", .paper_name = "CMA-ES", .is_stochastic = true, .contact_range_m = kTouching_m},
      [](const auto& o, const Sampling&) { return std::make_unique<CmaEsSolver>(o); });
}

const SolverEntry* SolverRegistry::Find(std::string_view word) const {
  for (const SolverEntry& entry : entries_) {
    if (entry.word == word) return &entry;
  }
  return nullptr;
}

const SolverEntry& SolverRegistry::Require(const std::string& word, const std::string& source) const {
  if (const SolverEntry* entry = Find(word)) return *entry;
  throw InputError({source, "solver", word, "is not known", SuggestName(word, words())});
}

std::vector<std::string> SolverRegistry::words() const {
  std::vector<std::string> words;
  for (const SolverEntry& entry : entries_) words.push_back(entry.word);
  return words;
}

void SolverRegistry::Add(SolverEntry entry) {
  if (entry.word.empty() || Find(entry.word) != nullptr) {
    throw InputError({"solver registry", "word", entry.word, "is empty or taken", "choose another one"});
  }
  if (entry.paper_name.empty()) entry.paper_name = entry.word;
  entries_.push_back(std::move(entry));
}

}  // namespace legopt
