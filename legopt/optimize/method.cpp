#include "legopt/optimize/method.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "legopt/blake2b.h"
#include "legopt/input_error.h"
#include "legopt/nearest_name.h"
#include "legopt/optimize/solve_outcome.h"

namespace legopt {

std::string_view ToString(SolveStatus status) {
  switch (status) {
    case SolveStatus::kNotRun:
      return "not_run";
    case SolveStatus::kConvergedFeasible:
      return "converged_feasible";
    case SolveStatus::kConvergedInfeasible:
      return "converged_infeasible";
    case SolveStatus::kIterationLimit:
      return "iteration_limit";
    case SolveStatus::kTimeLimit:
      return "time_limit";
    case SolveStatus::kNumericalFailure:
      return "numerical_failure";
    case SolveStatus::kCancelled:
      return "cancelled";
  }
  return "not_run";
}

namespace {

using nlohmann::json;

constexpr int kMaxMultiStarts = 1000;

/// Reads the keys of one JSON object into variables with ranges; knows its keys, so that it can refuse others.
class KeyReader {
 public:
  KeyReader(const json& object, std::string source, std::string where)
      : object_(object), source_(std::move(source)), where_(std::move(where)) {
    if (!object.is_object())
      Fail(where_, object.dump(), "must be a map of keys and values", "write 'key: value' pairs");
  }

  void Number(const char* key, double& value, double low, double high) {
    const json* found = Find(key);
    if (found == nullptr) return;
    if (!found->is_number()) Fail(Field(key), found->dump(), "must be a number", Range(low, high));
    const double read = found->get<double>();
    if (!(read >= low && read <= high)) Fail(Field(key), found->dump(), "is out of range", Range(low, high));
    value = read;
  }

  void Integer(const char* key, int& value, int low, int high) {
    const json* found = Find(key);
    if (found == nullptr) return;
    if (!found->is_number_integer()) Fail(Field(key), found->dump(), "must be a whole number", Range(low, high));
    const auto read = found->get<long long>();
    if (read < low || read > high) Fail(Field(key), found->dump(), "is out of range", Range(low, high));
    value = static_cast<int>(read);
  }

  void Boolean(const char* key, bool& value) {
    const json* found = Find(key);
    if (found == nullptr) return;
    if (!found->is_boolean()) Fail(Field(key), found->dump(), "must be true or false", "write true or false");
    value = found->get<bool>();
  }

  void Text(const char* key, std::string& value) {
    const json* found = Find(key);
    if (found == nullptr) return;
    if (!found->is_string() || found->get<std::string>().empty()) {
      Fail(Field(key), found->dump(), "must be a text", "write a name");
    }
    value = found->get<std::string>();
  }

  void Choice(const char* key, std::string& value, const std::vector<std::string>& choices) {
    Text(key, value);
    for (const std::string& choice : choices) {
      if (choice == value) return;
    }
    Fail(Field(key), value, "is not known", SuggestName(value, choices));
  }

  const json* Map(const char* key) { return Find(key); }

  /// After all keys are read: throws for the first one that nobody asked for.
  void RefuseOthers() const {
    for (const auto& [key, value] : object_.items()) {
      bool known = false;
      for (const std::string& name : keys_) known = known || name == key;
      if (!known) Fail(Field(key.c_str()), "", "unknown key", SuggestName(key, keys_));
    }
  }

  [[noreturn]] void Fail(const std::string& field, const std::string& value, const std::string& message,
                         const std::string& fix) const {
    throw InputError({source_, field, value, message, fix});
  }

 private:
  const json* Find(const char* key) {
    keys_.emplace_back(key);
    const auto found = object_.find(key);
    return found == object_.end() ? nullptr : &*found;
  }

  std::string Field(const char* key) const { return where_.empty() ? key : where_ + "." + key; }

  static std::string Range(double low, double high) {
    return "give a value from " + json(low).dump() + " to " + json(high).dump();
  }

  const json& object_;
  std::string source_;
  std::string where_;
  std::vector<std::string> keys_;
};

constexpr double kTiny = 1e-12;
constexpr double kHuge = 1e15;

void ReadOptions(const json& object, const std::string& source, const std::string& where, Method& method) {
  KeyReader reader(object, source, where);
  SqpOptions& sqp = method.sqp;
  reader.Number("trust_box_size", sqp.trust_box_size, kTiny, 10.0);
  reader.Number("min_trust_box_size", sqp.min_trust_box_size, kTiny, 1.0);
  reader.Number("trust_shrink_ratio", sqp.trust_shrink_ratio, 1e-3, 0.99);
  reader.Number("trust_expand_ratio", sqp.trust_expand_ratio, 1.0, 100.0);
  reader.Number("improve_ratio_threshold", sqp.improve_ratio_threshold, 1e-6, 0.99);
  reader.Number("min_approx_improve", sqp.min_approx_improve, 0.0, kHuge);
  reader.Number("min_approx_improve_frac", sqp.min_approx_improve_frac, 0.0, 1.0);
  reader.Number("constraint_tolerance", sqp.constraint_tolerance, kTiny, 1e-3);
  reader.Number("initial_penalty", sqp.initial_penalty, kTiny, kHuge);
  reader.Number("penalty_increase_ratio", sqp.penalty_increase_ratio, 1.001, 1e6);
  reader.Integer("max_penalty_iterations", sqp.max_penalty_iterations, 1, 20);
  reader.Integer("max_iterations", sqp.max_iterations, 1, 100000);
  reader.Choice("subproblem", sqp.subproblem, {"interior_point", "ipopt"});
  reader.Number("restart_noise_deg", method.restart_noise_deg, 0.0, 180.0);
  reader.Number("collision_margin_m", method.collision_margin_m, 0.0, 0.1);
  reader.Number("contact_range_m", method.contact_range_m, 1e-3, 1.0);
  reader.RefuseOthers();
  if (sqp.trust_box_size <= sqp.min_trust_box_size) {
    reader.Fail(where + ".trust_box_size", json(sqp.trust_box_size).dump(), "must exceed min_trust_box_size",
                "raise it or lower min_trust_box_size");
  }
  if (method.contact_range_m <= method.collision_margin_m) {
    reader.Fail(where + ".contact_range_m", json(method.contact_range_m).dump(), "must exceed collision_margin_m",
                "raise it or lower collision_margin_m");
  }
}

}  // namespace

Method Method::FromJson(const json& description, const std::string& source) {
  Method method;
  KeyReader reader(description, source, "");
  if (!description.contains("solver")) {
    reader.Fail("solver", "", "is missing", "add 'solver: sqp'");
  }
  reader.Choice("solver", method.solver, {"sqp"});
  method.name = "SQP";
  reader.Text("name", method.name);
  reader.Integer("multi_starts", method.multi_starts, 0, kMaxMultiStarts);
  reader.Integer("sample_size", method.sample_size_percent, 1, 100);
  reader.Boolean("incremental", method.incremental);
  if (const json* options = reader.Map("options"); options != nullptr) ReadOptions(*options, source, "options", method);
  reader.RefuseOthers();
  if (method.sample_size_percent != 100) {
    reader.Fail("sample_size", std::to_string(method.sample_size_percent), "solver sqp uses all terms",
                "leave sample_size at 100");
  }
  if (method.incremental) reader.Fail("incremental", "true", "solver sqp uses all terms", "leave incremental at false");
  return method;
}

json Method::ToJson() const {
  return {{"name", name},
          {"solver", solver},
          {"multi_starts", multi_starts},
          {"sample_size", sample_size_percent},
          {"incremental", incremental},
          {"options",
           {{"trust_box_size", sqp.trust_box_size},
            {"min_trust_box_size", sqp.min_trust_box_size},
            {"trust_shrink_ratio", sqp.trust_shrink_ratio},
            {"trust_expand_ratio", sqp.trust_expand_ratio},
            {"improve_ratio_threshold", sqp.improve_ratio_threshold},
            {"min_approx_improve", sqp.min_approx_improve},
            {"min_approx_improve_frac", sqp.min_approx_improve_frac},
            {"constraint_tolerance", sqp.constraint_tolerance},
            {"initial_penalty", sqp.initial_penalty},
            {"penalty_increase_ratio", sqp.penalty_increase_ratio},
            {"max_penalty_iterations", sqp.max_penalty_iterations},
            {"max_iterations", sqp.max_iterations},
            {"subproblem", sqp.subproblem},
            {"restart_noise_deg", restart_noise_deg},
            {"collision_margin_m", collision_margin_m},
            {"contact_range_m", contact_range_m}}}};
}

std::string Method::Hash() const {
  json canonical = ToJson();
  canonical.erase("name");
  return Blake2bHex(canonical.dump());
}

}  // namespace legopt
