#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "legopt/methods/solver_options.h"
#include "legopt/optimize/sampling.h"

namespace legopt {

class Solver;

/// What a method, a suite and a table must know of a solver.
struct SolverFacts {
  std::string word = {};          ///< value of a method's `solver`
  std::string paper_name = {};    ///< what tables print, without the "I-" of incremental variants; empty: the word
  bool samples = false;           ///< sample_size and incremental apply
  bool draws = false;             ///< draws random numbers even with all terms
  std::string mark = {};          ///< at the end of all names of its methods, chosen ones too; empty: none
  double contact_range_m = 0.03;  ///< default of that option: wide for solvers that see rows before they are violated
};

/// One solver that a method may name: all that the library knows of it.
struct SolverEntry : SolverFacts {
  SolverOptions defaults;  ///< of the type that `make` takes
  /// Makes a solver with options of the type of `defaults`. Throws std::bad_variant_access for others.
  std::function<std::unique_ptr<Solver>(const SolverOptions& options, const Sampling& sampling)> make;
};

/// The solvers that methods may name: those of the library, and what a program adds of its own before it reads methods:
///
///     SolverRegistry registry;
///     registry.Register<MyOptions>({.word = "mine", .paper_name = "Mine"},
///                                  [](const MyOptions& options, const Sampling&) {
///                                    return std::make_unique<MySolver>(options);
///                                  });
///     const Method method = Method::FromJson({{"solver", "mine"}}, "mine.json", registry);
///     const std::unique_ptr<Solver> solver = MakeSolver(method, registry);
///
/// A value that is handed to whoever reads or solves methods, and no list of the process: two parts of a program cannot
/// disturb each other, nothing depends on the order in which translation units start, and a library that is linked
/// statically does not lose rows of which nobody speaks. Options of one's own are any struct with a Visit
/// (option_fields.h); they are read, checked, written and hashed as those of the library are. The library's own are
/// alternatives of a variant instead, so that code that knows them needs no cast. Reading is thread-safe.
class SolverRegistry {
 public:
  /// The solvers of the library, in the order of the documentation.
  SolverRegistry();

  /// Adds a solver with options of type `Options`, as in `defaults` where a method says nothing; `make`, called as
  /// make(const Options&, const Sampling&), returns a std::unique_ptr to a Solver. Throws InputError when the word is
  /// empty or taken.
  template <class Options, class Make>
  void Register(SolverFacts facts, Make make, Options defaults = Options()) {
    SolverEntry entry{std::move(facts), MakeSolverOptions(std::move(defaults)), nullptr};
    entry.make = [make = std::move(make)](const SolverOptions& options, const Sampling& sampling) {
      return std::unique_ptr<Solver>(make(OptionsAs<Options>(options), sampling));
    };
    Add(std::move(entry));
  }

  /// Null when unknown. Valid until the next Register.
  const SolverEntry* Find(std::string_view word) const;
  /// The same; throws InputError that names `source` and the nearest word.
  const SolverEntry& Require(const std::string& word, const std::string& source) const;

  /// In the order of registration, the library's first; valid until the next Register.
  std::span<const SolverEntry> entries() const { return entries_; }
  auto begin() const { return entries_.begin(); }  ///< of entries()
  auto end() const { return entries_.end(); }      ///< of entries()
  std::vector<std::string> words() const;          ///< those that Find knows, in the same order

 private:
  void Add(SolverEntry entry);

  std::vector<SolverEntry> entries_;
};

}  // namespace legopt
