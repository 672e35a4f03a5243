#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "legopt/solvers/methods/registry.h"
#include "legopt/solvers/methods/solver_options.h"
#include "legopt/solvers/sqp_options.h"
#include "legopt/types/collision.h"

namespace legopt {

class OptionDiagnostics;

/// A method of the benchmark: a solver with its options, described in the paper's terms. One row of Table I.
///
/// JSON (and suite YAML) form; only `solver` is required:
///
///     {"name": "SQP", "solver": "sqp", "multi_starts": 10, "sample_size": 100, "incremental": false,
///      "options": {"trust_box_size": 0.1, ...}}
///
/// `name` is printed in tables (default: the paper's name of the solver) and is not part of the hash.
///
/// A method can be read from text (FromJson) or made in C++, from the defaults of a solver (Of) or from those of SQP.
/// It is plain data and may hold invalid values; code that solves with it or writes it checks it first.
struct Method {
  std::string name = "SQP";       ///< printed in tables; not part of the hash
  std::string solver = "sqp";     ///< name of a solver in the registry
  int multi_starts = 0;           ///< restarts, 0..kMaxMultiStarts (docs/explanation/paper.md#restarts)
  int sample_size_percent = 100;  ///< share of terms refreshed per iteration, 1..100
  bool incremental = false;       ///< keep the last model or gradient of terms that are not refreshed

  // Options of every method: formulation of the problem for the solver.
  double restart_noise_deg = 5.0;  ///< half width of the uniform noise on every joint at a restart, [0, 180]
  SceneRepresentation collision = SceneRepresentation::kSolid;  ///< model of the obstacles
  PairSelection pairs = PairSelection::kAll;                    ///< compared link pairs
  double collision_margin_m = 5e-4;  ///< distance kept from obstacles, [0, 0.1] (guards against ODE's triangle depths)
  double contact_range_m = 0.03;     ///< pairs closer than this enter the problem, (collision_margin_m, 1]
  /// Treatment of collisions between consecutive waypoints of motions (paper, section V).
  ContinuousCollision continuous_collision = ContinuousCollision::kPreferred;
  double continuous_weight = 1e2;  ///< weight of kPreferred: F grows by it per metre of penetration, > 0

  SolverOptions options = SqpOptions();  ///< options of `solver`, of the type that it takes

  /// Maximum number of restarts of a method.
  static constexpr int kMaxMultiStarts = 1'000'000;

  /// Returns the defaults of a solver. Throws InputError if the solver is unknown.
  static Method Of(const std::string& solver, const SolverRegistry& registry = {});

  /// Reads a method. Throws one InputError with all diagnostics, one per line: unknown keys (with the nearest valid
  /// ones), wrong types, and those of Validate. `source` is the file name in messages.
  static Method FromJson(const nlohmann::json& description, const std::string& source,
                         const SolverRegistry& registry = {});

  /// Reads the canonical form (ToJson), for example from a database. An absent `pairs` means `reference` there, the
  /// only selection when the form was defined. Throws as FromJson.
  static Method FromCanonical(const nlohmann::json& canonical, const std::string& source,
                              const SolverRegistry& registry = {});

  /// Throws one InputError with all diagnostics, one per line: unknown solver, options of another solver, values out of
  /// range or not finite, and violated conditions between fields.
  void Validate(const SolverRegistry& registry = {}) const;

  /// Returns the canonical form, read by FromCanonical: every option that applies, including defaults, but without
  /// `pairs: reference` (this keeps the hashes of older releases). Throws one InputError with all invalid values. Does
  /// not check whether the solver exists.
  nlohmann::json ToJson() const;

  /// Returns the BLAKE2b-256 of the canonical form without the name, 64 hexadecimal digits. Throws as ToJson.
  std::string Hash() const;

  /// Returns true if the outcome depends on random numbers. Throws InputError if the solver is unknown.
  bool is_stochastic(const SolverRegistry& registry = {}) const;

 private:
  static Method Read(const nlohmann::json& description, const std::string& source, const SolverRegistry& registry,
                     PairSelection pairs_if_absent);
  void CheckValues(OptionDiagnostics& faults) const;
  void CheckSolver(const SolverRegistry& registry, OptionDiagnostics& faults) const;
};

/// Validates a method and creates its solver.
std::unique_ptr<Solver> MakeSolver(const Method& method, const SolverRegistry& registry = {});

}  // namespace legopt
