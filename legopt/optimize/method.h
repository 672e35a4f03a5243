#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "legopt/optimize/sqp_options.h"

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
  std::string solver = "sqp";      ///< "sqp"
  int multi_starts = 0;            ///< restarts after a failed attempt, 0..1000 (reading 29)
  int sample_size_percent = 100;   ///< share of terms refreshed per iteration
  bool incremental = false;        ///< keep the last model of terms that are not refreshed
  double restart_noise_deg = 5.0;  ///< half width of the uniform noise on every joint at a restart, (0, 180]
  double collision_margin_m =
      5e-4;  ///< distance kept from obstacles, [0, 0.1] (lessons: guards against ODE's triangle depths)
  double contact_range_m = 0.03;  ///< pairs closer than this enter the problem, (collision_margin_m, 1]
  SqpOptions sqp;

  /// Throws InputError naming every unknown key (with the nearest valid one), wrong type and value out of range;
  /// `source` names the file in errors.
  static Method FromJson(const nlohmann::json& description, const std::string& source);

  /// Canonical form: every option, defaults included.
  nlohmann::json ToJson() const;

  /// BLAKE2b-256 of the canonical form without the name, 64 hexadecimal digits.
  std::string Hash() const;
};

}  // namespace legopt
