#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "legopt/optimize/best_options.h"
#include "legopt/optimize/gradient_direction.h"
#include "legopt/optimize/gradient_options.h"
#include "legopt/optimize/ipopt_options.h"
#include "legopt/optimize/option_fields.h"
#include "legopt/optimize/sqp_options.h"
#include "legopt/optimize/stomp_options.h"
#include "legopt/optimize/waypoint_metric.h"

namespace legopt {

/// One method of the benchmark: a solver with its options, described by the paper's words. One row of Table I.
///
/// JSON (and suite YAML) form; only `solver` is required:
///
///     {"name": "SQP", "solver": "sqp", "multi_starts": 10, "sample_size": 100, "incremental": false,
///      "options": {"trust_box_size": 0.1, ...}}
///
/// `name` is what tables print (default: the paper's name of the solver) and does not enter the hash.
struct Method {
  std::string name = "SQP";
  std::string solver = "sqp";     ///< a word of the registry
  int multi_starts = 0;           ///< restarts, 0..kMostMultiStarts (docs/readings.md#restarts)
  int sample_size_percent = 100;  ///< share of terms refreshed per iteration
  bool incremental = false;       ///< keep the last model or gradient of terms that are not refreshed

  // Options of every method: how the problem is posed to the solver.
  double restart_noise_deg = 5.0;    ///< half width of the uniform noise on every joint at a restart, (0, 180]
  std::string collision = "solid";   ///< obstacles: "solid", or "surface" (docs/readings.md#two-sided-triangles)
  double collision_margin_m = 5e-4;  ///< distance kept from obstacles, [0, 0.1] (guards against ODE's triangle depths)
  double contact_range_m = 0.03;     ///< pairs closer than this enter the problem, (collision_margin_m, 1]
  /// Motions: collision between consecutive waypoints (paper, section V). "none"; "preferred": a penalty of fixed
  /// weight that cannot make a window fail, because the task does not require it; "required": a constraint like the
  /// others.
  std::string continuous_collision = "preferred";
  double continuous_weight = 1e2;  ///< of "preferred": F grows by it per metre of penetration, > 0

  // Options of the solvers; those of `solver` count.
  SqpOptions sqp;
  BestOptions best;
  IpoptOptions ipopt;
  GradientOptions gradient;  ///< sgd, adam, nadam, chomp
  MomentOptions moments;     ///< adam, nadam
  MetricOptions metric;      ///< chomp
  StompOptions stomp;

  static constexpr int kMostMultiStarts = 1'000'000;

  /// Throws InputError for the first unknown key (naming the nearest valid one), wrong type or value out of range;
  /// `source` names the file in errors.
  static Method FromJson(const nlohmann::json& description, const std::string& source);

  /// Canonical form: every option that applies, defaults included.
  nlohmann::json ToJson() const;

  /// BLAKE2b-256 of the canonical form without the name, 64 hexadecimal digits.
  std::string Hash() const;

  /// True when the outcome depends on random draws.
  bool draws() const;

  /// All options of the chosen solver.
  void VisitOptions(OptionFields& fields);
};

}  // namespace legopt
