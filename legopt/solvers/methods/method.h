#pragma once

#include <any>
#include <concepts>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "legopt/solvers/internal/option_fields.h"
#include "legopt/solvers/solver.h"
#include "legopt/solvers/sqp_options.h"
#include "legopt/types/collision.h"
#include "legopt/types/physics.h"

namespace legopt {

/// Options of one solver: a value of any copyable struct with a Visit (option_fields.h), of the library or of a program
/// that registers its solver (method.h).
class SolverOptions {
 public:
  /// Stores a copy of `options`.
  template <class Options>
  requires(!std::same_as<Options, SolverOptions>) SolverOptions(Options options)  // NOLINT(google-explicit-constructor)
      : options_(std::move(options)),
        edit_([](std::any& any, OptionFields& fields) { Options::Visit(std::any_cast<Options&>(any), fields); }),
        view_([](const std::any& any, ConstOptionFields& fields) {
          Options::Visit(std::any_cast<const Options&>(any), fields);
        }) {}

  /// Returns the stored options. Throws std::bad_any_cast if they are of another type.
  template <class Options>
  Options& As() {
    return std::any_cast<Options&>(options_);
  }
  /// Returns the stored options read-only. Throws std::bad_any_cast if they are of another type.
  template <class Options>
  const Options& As() const {
    return std::any_cast<const Options&>(options_);
  }

  /// Returns whether both store options of one type.
  bool HasTypeOf(const SolverOptions& other) const { return options_.type() == other.options_.type(); }

  /// Visits the fields of the stored options; the visitor may change them.
  void Visit(OptionFields& fields) { edit_(options_, fields); }
  /// Visits the fields of the stored options read-only.
  void Visit(ConstOptionFields& fields) const { view_(options_, fields); }

 private:
  std::any options_;
  void (*edit_)(std::any& options, OptionFields& fields);
  void (*view_)(const std::any& options, ConstOptionFields& fields);
};

class Solver;

/// Properties of a solver that methods, suites and tables use.
struct SolverProperties {
  std::string word = {};          ///< value of a method's `solver`
  std::string paper_name = {};    ///< name printed in tables, without the "I-" of incremental variants; empty: `word`
  bool samples = false;           ///< sample_size and incremental apply
  bool is_stochastic = false;     ///< uses random numbers even with all terms
  std::string mark = {};          ///< suffix of all names of its methods, including user-defined ones; empty: none
  double contact_range_m = 0.03;  ///< default of that option; wide if the solver uses rows before they are violated
};

/// A solver that a method may name, with its defaults and its factory.
struct SolverEntry : SolverProperties {
  SolverOptions defaults;  ///< defaults, of the type that `make` takes
  /// Creates a solver with options of the type of `defaults`. Throws std::bad_any_cast for other types.
  std::function<std::unique_ptr<Solver>(const SolverOptions& options, const Sampling& sampling)> make;
};

/// The solvers that methods may name: those of the library, and those that a program registers before it reads methods:
///
///     SolverRegistry registry;
///     registry.Register<MyOptions>({.word = "mine", .paper_name = "Mine"},
///                                  [](const MyOptions& options, const Sampling&) {
///                                    return std::make_unique<MySolver>(options);
///                                  });
///     const Method method = Method::FromJson({{"solver", "mine"}}, "mine.json", registry);
///     const std::unique_ptr<Solver> solver = MakeSolver(method, registry);
///
/// The registry is a value that is passed to code that reads or solves methods; it is not a global list. Hence parts of
/// a program cannot disturb each other, nothing depends on the order of static initialisation, and a statically linked
/// library loses no entries. Custom options are any struct with a Visit (option_fields.h). They are read, checked,
/// written and hashed like those of the library. Reading is thread-safe.
class SolverRegistry {
 public:
  /// Creates a registry with the solvers of the library, in the order of the documentation.
  SolverRegistry();

  /// Adds a solver with options of type `Options`. `defaults` apply where a method gives no value. `make`, called as
  /// make(const Options&, const Sampling&), returns a std::unique_ptr to a Solver. Throws InputError if the word is
  /// empty or taken.
  template <class Options, class Make>
  void Register(SolverProperties facts, Make make, Options defaults = Options()) {
    SolverEntry entry{std::move(facts), std::move(defaults), nullptr};
    entry.make = [make = std::move(make)](const SolverOptions& options, const Sampling& sampling) {
      return std::unique_ptr<Solver>(make(options.As<Options>(), sampling));
    };
    Add(std::move(entry));
  }

  /// Returns the entry, or null if the solver is unknown. Valid until the next Register.
  const SolverEntry* Find(std::string_view word) const;
  /// Returns the entry. Throws an InputError with `source` and the nearest name if the solver is unknown.
  const SolverEntry& Require(const std::string& word, const std::string& source) const;

  /// Returns all entries in order of registration, the library's first; valid until the next Register.
  std::span<const SolverEntry> entries() const { return entries_; }
  auto begin() const { return entries_.begin(); }
  auto end() const { return entries_.end(); }
  std::vector<std::string> words() const;  ///< names of all entries, in the same order

 private:
  void Add(SolverEntry entry);

  std::vector<SolverEntry> entries_;
};

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
  Physics physics = Physics::kNone;  ///< static equilibrium at waypoints beyond the task's balance
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
  /// Visits all keys and options, of every method and of the solver, also those that the canonical form omits.
  void Visit(ConstOptionFields& fields) const;

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
