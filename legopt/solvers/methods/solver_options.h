#pragma once

#include <concepts>
#include <type_traits>
#include <utility>
#include <variant>

#include "legopt/solvers/best_options.h"
#include "legopt/solvers/chomp_options.h"
#include "legopt/solvers/cma_es_options.h"
#include "legopt/solvers/gradient_options.h"
#include "legopt/solvers/ipopt_options.h"
#include "legopt/solvers/methods/custom_options.h"
#include "legopt/solvers/sqp_options.h"
#include "legopt/solvers/stomp_options.h"

namespace legopt {

/// Options of one solver, either of the library or registered by a program (registry.h).
using SolverOptions = std::variant<SqpOptions, BestOptions, IpoptOptions, GradientOptions, MomentGradientOptions,
                                   ChompOptions, StompOptions, CmaEsOptions, CustomOptions>;

namespace internal {

template <class Options, class Variant>
inline constexpr bool kIsAlternative = false;
template <class Options, class... Alternatives>
inline constexpr bool kIsAlternative<Options, std::variant<Alternatives...>> = (std::is_same_v<Options, Alternatives> ||
                                                                                ...);

}  // namespace internal

/// Converts options of any type to SolverOptions.
template <class Options>
SolverOptions MakeSolverOptions(Options options) {
  if constexpr (internal::kIsAlternative<Options, SolverOptions>) {
    return options;
  } else {
    return CustomOptions(std::move(options));
  }
}

/// Returns options as `Options`, the inverse of MakeSolverOptions; const if the options are. Throws
/// std::bad_variant_access if they are of another type.
template <class Options, class Held>
requires std::same_as<std::remove_const_t<Held>, SolverOptions>
auto& OptionsAs(Held& options) {
  if constexpr (internal::kIsAlternative<Options, SolverOptions>) {
    return std::get<Options>(options);
  } else {
    if (auto* found = std::get<CustomOptions>(options).template Get<Options>()) return *found;
    throw std::bad_variant_access();
  }
}

/// Visits the fields of the stored options.
inline void VisitOptions(SolverOptions& options, OptionFields& fields) {
  std::visit([&](auto& held) { held.Visit(held, fields); }, options);
}
/// Visits the fields of the stored options read-only.
inline void VisitOptions(const SolverOptions& options, ConstOptionFields& fields) {
  std::visit([&](const auto& held) { held.Visit(held, fields); }, options);
}

/// Returns whether both are options of one type.
inline bool HaveSameType(const SolverOptions& a, const SolverOptions& b) {
  if (a.index() != b.index()) return false;
  const auto* foreign = std::get_if<CustomOptions>(&a);
  return foreign == nullptr || foreign->type() == std::get<CustomOptions>(b).type();
}

}  // namespace legopt
