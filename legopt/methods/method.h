#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "legopt/methods/registry.h"
#include "legopt/methods/solver_options.h"
#include "words/collision.h"

namespace legopt {

class OptionFaults;

/// One method of the benchmark: a solver with its options, described by the paper's words. One row of Table I.
///
/// JSON (and suite YAML) form; only `solver` is required:
///
///     {"name": "SQP", "solver": "sqp", "multi_starts": 10, "sample_size": 100, "incremental": false,
///      "options": {"trust_box_size": 0.1, ...}}
///
/// `name` is what tables print (default: the paper's name of the solver) and does not enter the hash.
///
/// A method may be made from text (FromJson) or in C++, from the defaults of a solver (Of) or from those of SQP. It is
/// plain data and may hold anything on the way; who solves with it or writes it down checks it before.
struct Method {
  std::string name = "SQP";       ///< what tables print; not part of the hash
  std::string solver = "sqp";     ///< a word of the registry
  int multi_starts = 0;           ///< restarts, 0..kMostMultiStarts (docs/readings.md#restarts)
  int sample_size_percent = 100;  ///< share of terms refreshed per iteration, 1..100
  bool incremental = false;       ///< keep the last model or gradient of terms that are not refreshed

  // Options of every method: how the problem is posed to the solver.
  double restart_noise_deg = 5.0;  ///< half width of the uniform noise on every joint at a restart, [0, 180]
  SceneRepresentation collision = SceneRepresentation::kSolid;  ///< obstacles (docs/readings.md#two-sided-triangles)
  PairSelection pairs = PairSelection::kAll;  ///< compared link pairs (docs/readings.md#ignored-link-pairs)
  double collision_margin_m = 5e-4;  ///< distance kept from obstacles, [0, 0.1] (guards against ODE's triangle depths)
  double contact_range_m = 0.03;     ///< pairs closer than this enter the problem, (collision_margin_m, 1]
  /// Motions: collision between consecutive waypoints (paper, section V).
  ContinuousCollision continuous_collision = ContinuousCollision::kPreferred;
  double continuous_weight = 1e2;  ///< of kPreferred: F grows by it per metre of penetration, > 0

  SolverOptions options = SqpOptions();  ///< of the solver, and of the type that it takes

  /// Most restarts that a method may ask for.
  static constexpr int kMostMultiStarts = 1'000'000;

  /// The defaults of a solver. Throws InputError for an unknown one.
  static Method Of(const std::string& solver, const SolverRegistry& registry = {});

  /// Throws one InputError of all faults, a line for each: unknown keys (naming the nearest valid ones), wrong types,
  /// and what Validate finds. `source` names the file in it.
  static Method FromJson(const nlohmann::json& description, const std::string& source,
                         const SolverRegistry& registry = {});

  /// Reads the canonical form (ToJson), for example of a database: an absent `pairs` is `reference` there, which was
  /// the only selection when the form was defined. Errors as of FromJson.
  static Method FromCanonical(const nlohmann::json& canonical, const std::string& source,
                              const SolverRegistry& registry = {});

  /// Throws one InputError of all faults, a line for each: an unknown solver, options of another one, values out of
  /// range or not finite, and conditions between fields that do not hold.
  void Validate(const SolverRegistry& registry = {}) const;

  /// Canonical form, read by FromCanonical: every option that applies, defaults included, `pairs: reference` alone left
  /// out (the hashes of older releases stay). Throws one InputError of all values that cannot be;
  /// whether there is such a solver is not asked, as it takes none to name it.
  nlohmann::json ToJson() const;

  /// BLAKE2b-256 of the canonical form without the name, 64 hexadecimal digits. Throws as ToJson.
  std::string Hash() const;

  /// True when the outcome depends on random draws. Throws InputError for an unknown solver.
  bool draws(const SolverRegistry& registry = {}) const;

 private:
  static Method Read(const nlohmann::json& description, const std::string& source, const SolverRegistry& registry,
                     PairSelection pairs_if_absent);
  void CheckValues(OptionFaults& faults) const;
  void CheckSolver(const SolverRegistry& registry, OptionFaults& faults) const;
};

/// The solver of a method, which it validates.
std::unique_ptr<Solver> MakeSolver(const Method& method, const SolverRegistry& registry = {});

}  // namespace legopt
