#pragma once

#include <any>
#include <concepts>
#include <utility>

#include "legopt/solvers/option_fields.h"

namespace legopt {

/// Options of one solver: a value of any copyable struct with a Visit (option_fields.h), of the library or of a program
/// that registers its solver (registry.h).
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

}  // namespace legopt
