#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "legopt/solvers/methods/solver_options.h"
#include "legopt/solvers/sampling.h"

namespace legopt {

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

}  // namespace legopt
