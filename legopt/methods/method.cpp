#include "legopt/methods/method.h"

#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "legopt/blake2b.h"
#include "legopt/methods/option_reader.h"
#include "legopt/methods/registry.h"
#include "legopt/optimize/solve_outcome.h"

namespace legopt {

namespace {

using nlohmann::json;

std::vector<std::string> SolverWords() {
  std::vector<std::string> words;
  for (const SolverEntry& entry : SolverRegistry()) words.emplace_back(entry.word);
  return words;
}

}  // namespace

void Method::VisitOptions(OptionFields& fields) {
  fields.Number("restart_noise_deg", restart_noise_deg, 0.0, 180.0);
  fields.Choice("collision", collision, {"solid", "surface"});
  fields.Number("collision_margin_m", collision_margin_m, 0.0, 0.1);
  fields.Number("contact_range_m", contact_range_m, 1e-3, 1.0);
  fields.Choice("continuous_collision", continuous_collision, {"none", "preferred", "required"});
  fields.Number("continuous_weight", continuous_weight, 1e-3, 1e6);
  fields.Require(contact_range_m > collision_margin_m, "contact_range_m", json(contact_range_m).dump(),
                 "must exceed collision_margin_m", "raise it or lower collision_margin_m");
  FindSolver(solver)->visit(*this, fields);
}

Method Method::FromJson(const json& description, const std::string& source) {
  Method method;
  OptionReader reader(description, source, "");
  if (!description.contains("solver")) {
    reader.Fail("solver", "", "is missing", "add it, for example 'solver: sqp'");
  }
  reader.Choice("solver", method.solver, SolverWords());
  const SolverEntry& entry = *FindSolver(method.solver);
  method.contact_range_m = entry.contact_range_m;
  reader.Integer("multi_starts", method.multi_starts, 0, kMostMultiStarts);
  reader.Integer("sample_size", method.sample_size_percent, 1, 100);
  reader.Boolean("incremental", method.incremental);
  method.name = (method.incremental ? "I-" : "") + std::string(entry.paper_name);
  reader.Text("name", method.name);
  if (const json* options = reader.Find("options"); options != nullptr) {
    OptionReader option_reader(*options, source, "options");
    method.VisitOptions(option_reader);
    option_reader.RefuseOthers();
  }
  reader.RefuseOthers();
  if (!entry.samples && method.sample_size_percent != 100) {
    reader.Fail("sample_size", std::to_string(method.sample_size_percent),
                "solver " + method.solver + " uses all terms", "leave sample_size at 100");
  }
  if (!entry.samples && method.incremental) {
    reader.Fail("incremental", "true", "solver " + method.solver + " uses all terms", "leave incremental at false");
  }
  return method;
}

json Method::ToJson() const {
  json options = json::object();
  OptionWriter writer(options);
  Method(*this).VisitOptions(writer);
  return {{"name", name},
          {"solver", solver},
          {"multi_starts", multi_starts},
          {"sample_size", sample_size_percent},
          {"incremental", incremental},
          {"options", options}};
}

std::string Method::Hash() const {
  json canonical = ToJson();
  canonical.erase("name");
  return Blake2bHex(canonical.dump());
}

bool Method::draws() const { return multi_starts > 0 || sample_size_percent < 100 || FindSolver(solver)->draws; }

}  // namespace legopt
