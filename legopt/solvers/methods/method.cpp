#include "legopt/solvers/methods/method.h"

#include <nlohmann/json.hpp>

#include "legopt/input/json.h"
#include "legopt/math/blake2b.h"
#include "legopt/solvers/internal/best_solver.h"
#include "legopt/solvers/internal/chomp_solver.h"
#include "legopt/solvers/internal/cma_es_solver.h"
#include "legopt/solvers/internal/gradient_solver.h"
#include "legopt/solvers/internal/ipopt_solver.h"
#include "legopt/solvers/internal/sqp_solver.h"
#include "legopt/solvers/internal/stomp_solver.h"
#include "legopt/solvers/methods/internal/option_visitors.h"
#include "legopt/solvers/solver.h"
#include "legopt/types/input_error.h"
#include "legopt/types/invariant.h"
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

namespace {

using nlohmann::json;

constexpr char kOptions[] = "options";

// Visits the keys outside of `options`.
void VisitHead(auto& method, auto& fields) {
  fields.Integer("multi_starts", method.multi_starts, 0, Method::kMaxMultiStarts);
  fields.Integer("sample_size", method.sample_size_percent, 1, 100);
  fields.Boolean("incremental", method.incremental);
}

void VisitAllOptions(auto& method, auto& fields) {
  fields.Number("restart_noise_deg", method.restart_noise_deg, 0.0, 180.0);
  fields.Choice("collision", method.collision);
  fields.ChoiceWithDefault("pairs", method.pairs, PairSelection::kReference);
  fields.ChoiceWithDefault("physics", method.physics, Physics::kNone);
  fields.Number("collision_margin_m", method.collision_margin_m, 0.0, 0.1);
  fields.Number("contact_range_m", method.contact_range_m, 1e-3, 1.0);
  fields.Choice("continuous_collision", method.continuous_collision);
  fields.Number("continuous_weight", method.continuous_weight, 1e-3, 1e6);
  fields.Require(method.contact_range_m > method.collision_margin_m, "contact_range_m", "collision_margin_m",
                 Dump(json(method.contact_range_m)), "must exceed collision_margin_m",
                 "raise it or lower collision_margin_m");
  method.options.Visit(fields);
}

Method DefaultsOf(const SolverEntry& entry) {
  Method method;
  method.name = entry.paper_name;
  method.solver = entry.word;
  method.contact_range_m = entry.contact_range_m;
  method.options = entry.defaults;
  return method;
}

void ReportUnknownSolver(const std::string& word, const SolverRegistry& registry, OptionDiagnostics& faults) {
  faults.Add("solver", word, "is not known", SuggestName(word, registry.words()));
}

// Returns null and adds a diagnostic if there is no such solver.
const SolverEntry* ReadSolver(OptionReader& reader, const SolverRegistry& registry, OptionDiagnostics& faults) {
  std::string word;
  const bool given = reader.Text("solver", word);
  if (!given && !faults.Has("solver")) faults.Add("solver", "", "is missing", "add it, for example 'solver: sqp'");
  if (!given) return nullptr;
  const SolverEntry* entry = registry.Find(word);
  if (entry == nullptr) ReportUnknownSolver(word, registry, faults);
  return entry;
}

std::string SourceOf(const Method& method) { return "method '" + method.name + "'"; }

}  // namespace

Method Method::Of(const std::string& solver, const SolverRegistry& registry) {
  return DefaultsOf(registry.Require(solver, "method"));
}

Method Method::FromJson(const json& description, const std::string& source, const SolverRegistry& registry) {
  return Read(description, source, registry, Method().pairs);
}

Method Method::FromCanonical(const json& canonical, const std::string& source, const SolverRegistry& registry) {
  return Read(canonical, source, registry, PairSelection::kReference);
}

Method Method::Read(const json& description, const std::string& source, const SolverRegistry& registry,
                    PairSelection pairs_if_absent) {
  OptionDiagnostics faults(source);
  if (!OptionReader::IsMap(description, "", faults)) faults.ThrowIfAny();
  OptionReader reader(description, "", faults);
  const SolverEntry* entry = ReadSolver(reader, registry, faults);
  Method method = entry == nullptr ? Method() : DefaultsOf(*entry);
  method.pairs = pairs_if_absent;
  VisitHead(method, reader);
  if (method.incremental) method.name = "I-" + method.name;
  reader.Text("name", method.name);
  if (entry != nullptr && !method.name.ends_with(entry->mark)) method.name += entry->mark;
  const json* options = reader.Find(kOptions);
  if (options != nullptr && OptionReader::IsMap(*options, kOptions, faults) && entry != nullptr) {
    OptionReader option_reader(*options, kOptions, faults);
    VisitAllOptions(method, option_reader);
    option_reader.RejectUnknownKeys();
  }
  reader.RejectUnknownKeys();
  method.CheckValues(faults);
  if (entry != nullptr) method.CheckSolver(registry, faults);
  faults.ThrowIfAny();
  return method;
}

void Method::CheckValues(OptionDiagnostics& faults) const {
  if (name.empty()) faults.Add("name", "", "must be a text", "write a name");
  OptionChecker head("", faults);
  VisitHead(*this, head);
  OptionChecker checker(kOptions, faults);
  VisitAllOptions(*this, checker);
}

void Method::CheckSolver(const SolverRegistry& registry, OptionDiagnostics& faults) const {
  const SolverEntry* entry = registry.Find(solver);
  if (entry == nullptr) return ReportUnknownSolver(solver, registry, faults);
  if (!options.HasTypeOf(entry->defaults)) {
    faults.Add(kOptions, "", "are those of another solver than " + solver, "begin with the defaults of " + solver);
  }
  if (entry->samples) return;
  if (sample_size_percent != 100 && !faults.Has("sample_size")) {
    faults.Add("sample_size", std::to_string(sample_size_percent), "solver " + solver + " uses all terms",
               "leave sample_size at 100");
  }
  if (incremental) {
    faults.Add("incremental", "true", "solver " + solver + " uses all terms", "leave incremental at false");
  }
}

void Method::Validate(const SolverRegistry& registry) const {
  OptionDiagnostics faults(SourceOf(*this));
  CheckSolver(registry, faults);
  CheckValues(faults);
  faults.ThrowIfAny();
}

json Method::ToJson() const {
  OptionDiagnostics faults(SourceOf(*this));
  CheckValues(faults);
  faults.ThrowIfAny();
  json description = {{"name", name}, {"solver", solver}};
  OptionWriter head(description);
  VisitHead(*this, head);
  OptionWriter writer(description[kOptions] = json::object());
  VisitAllOptions(*this, writer);
  return description;
}

void Method::Visit(ConstOptionFields& fields) const {
  VisitHead(*this, fields);
  VisitAllOptions(*this, fields);
}

std::string Method::Hash() const {
  json canonical = ToJson();
  canonical.erase("name");
  return Blake2bHex(Dump(canonical));
}

bool Method::is_stochastic(const SolverRegistry& registry) const {
  const SolverEntry& entry = registry.Require(solver, SourceOf(*this));
  return multi_starts > 0 || sample_size_percent < 100 || entry.is_stochastic;
}

std::unique_ptr<Solver> MakeSolver(const Method& method, const SolverRegistry& registry) {
  method.Validate(registry);
  std::unique_ptr<Solver> solver =
      registry.Find(method.solver)->make(method.options, {method.sample_size_percent, method.incremental});
  CheckInvariant(solver != nullptr, "a registered solver is made", method.solver);
  return solver;
}

}  // namespace legopt
