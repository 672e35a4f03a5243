#include "programs/external/protocol.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "programs/external/line_channel.h"
#include "programs/printable.h"

namespace legopt::external {
namespace {

using nlohmann::json;

constexpr int kDeepest = 2;              // {"x": [..]}
constexpr std::size_t kShownBytes = 80;  // of a line, in a fault
constexpr std::size_t kMaxNameBytes = 200;
constexpr std::pair<std::string_view, Claim> kClaims[] = {
    {"converged", Claim::kConverged}, {"limit", Claim::kLimit}, {"failed", Claim::kFailed}};

std::string Excerpt(std::string_view line) {
  const bool cut = line.size() > kShownBytes;
  return "'" + programs::Printable(std::string(line.substr(0, kShownBytes))) + (cut ? "...'" : "'");
}

/// The fields of one message, with its type for faults.
class MessageFields {
 public:
  explicit MessageFields(std::string_view line) {
    // What is nested deeper than any message is not built: a line of brackets would become gigabytes.
    bool too_deep = false;
    const auto watch = [&too_deep](int depth, json::parse_event_t event, json&) {
      const bool opens = event == json::parse_event_t::array_start || event == json::parse_event_t::object_start;
      if (opens && depth >= kDeepest) too_deep = true;
      return !too_deep;
    };
    object_ = json::parse(line, watch, false);
    if (too_deep || !object_.is_object()) {
      throw SolverFault("sent a line that is no JSON object of the protocol (NaN and Infinity are no JSON): " +
                        Excerpt(line));
    }
    const auto type = object_.find("type");
    if (type == object_.end() || !type->is_string()) throw SolverFault("sent a line without a type: " + Excerpt(line));
    type_ = type->get<std::string>();
  }

  const std::string& type() const { return type_; }

  const json& Get(const char* key) const {
    const auto found = object_.find(key);
    if (found == object_.end()) throw SolverFault("sent '" + type_ + "' without '" + key + "'");
    return *found;
  }

  [[noreturn]] void Refuse(const char* key, const std::string& rule) const {
    const std::string value = object_.at(key).dump(-1, ' ', false, json::error_handler_t::replace);
    throw SolverFault("sent '" + type_ + "' whose '" + key + "' is not " + rule + ": " + Excerpt(value));
  }

  double Number(const char* key) const {
    const json& value = Get(key);
    if (!value.is_number() || !std::isfinite(value.get<double>())) Refuse(key, "a finite number");
    return value.get<double>();
  }

  std::int64_t Integer(const char* key) const {
    const json& value = Get(key);
    if (!value.is_number_integer()) Refuse(key, "a whole number");
    return value.get<std::int64_t>();
  }

  bool Boolean(const char* key) const {
    const json& value = Get(key);
    if (!value.is_boolean()) Refuse(key, "true or false");
    return value.get<bool>();
  }

  std::string Name(const char* key) const {
    const json& value = Get(key);
    if (!value.is_string() || value.get_ref<const std::string&>().size() > kMaxNameBytes) {
      Refuse(key, "a text of at most " + std::to_string(kMaxNameBytes) + " bytes");
    }
    return value.get<std::string>();
  }

  Eigen::VectorXd Vector(const char* key, int size) const {
    const json& values = Get(key);
    if (!values.is_array()) Refuse(key, "a list of numbers");
    if (values.size() != static_cast<std::size_t>(size)) {
      throw SolverFault("sent '" + type_ + "' with " + std::to_string(values.size()) + " numbers in '" + key +
                        "' where the program has " + std::to_string(size) + " variables");
    }
    Eigen::VectorXd vector(size);
    for (int i = 0; i < size; ++i) {
      const json& value = values[static_cast<std::size_t>(i)];
      if (!value.is_number() || !std::isfinite(value.get<double>())) Refuse(key, "a list of finite numbers");
      vector[i] = value.get<double>();
    }
    return vector;
  }

  Claim Status(const char* key) const {
    const std::string word = Name(key);
    for (const auto& [known, claim] : kClaims) {
      if (word == known) return claim;
    }
    Refuse(key, "one of converged, limit, failed");
  }

 private:
  json object_;
  std::string type_;
};

Hello ReadHello(const MessageFields& fields) {
  if (fields.Integer("protocol") != kProtocol) fields.Refuse("protocol", std::to_string(kProtocol));
  return {fields.Name("name"), fields.Name("version")};
}

json BoundsJson(const Eigen::VectorXd& bounds) {
  json list = json::array();
  for (const double bound : bounds) list.push_back(std::isfinite(bound) ? json(bound) : json());
  return list;
}

const char* KindWord(TermKind kind) {
  if (kind == TermKind::kEquality) return "equality";
  return kind == TermKind::kInequality ? "inequality" : "preference";
}

json RowsJson(const std::vector<SlottedProgram::Row>& rows) {
  json list = json::array();
  for (const SlottedProgram::Row& row : rows) {
    json item = {{"kind", KindWord(row.kind)}, {"first", row.first}, {"size", row.size}};
    if (row.kind == TermKind::kPreference) item["weight"] = row.weight;
    list.push_back(std::move(item));
  }
  return list;
}

std::vector<double> GradientOf(const SlottedProgram& program) {
  const ConvexSubproblem& cost = program.cost();
  std::vector<double> gradient;
  for (int i = 0; i < program.num_variables(); ++i) {
    const int padded = i / cost.block_size() * cost.stride() + i % cost.block_size();
    gradient.push_back(cost.gradient()[static_cast<std::size_t>(padded)]);
  }
  return gradient;
}

json JacobianJson(const SlottedProgram& program) {
  json list = json::array();
  for (const SlottedProgram::Row& row : program.rows()) {
    const auto begin = program.jacobian().begin() + static_cast<std::ptrdiff_t>(row.begin);
    list.push_back(std::vector<double>(begin, begin + row.size));
  }
  return list;
}

}  // namespace

SolverMessage ReadMessage(std::string_view line, int num_variables) {
  const MessageFields fields(line);
  if (fields.type() == "hello") return ReadHello(fields);
  if (fields.type() == "evaluate") {
    return EvaluateRequest{fields.Integer("id"), fields.Vector("x", num_variables), fields.Boolean("gradients")};
  }
  if (fields.type() == "progress") return ProgressReport{fields.Number("cost"), fields.Number("violation")};
  if (fields.type() == "solution") return SolutionReport{fields.Vector("x", num_variables), fields.Status("status")};
  throw SolverFault("sent a message of the unknown type " + Excerpt(fields.type()));
}

std::string SolveLine(const SlottedProgram& program, int num_waypoints, const SolveTerms& terms) {
  return json{{"type", "solve"},
              {"protocol", kProtocol},
              {"variables", program.num_variables()},
              {"waypoints", num_waypoints},
              {"lower", BoundsJson(program.lower())},
              {"upper", BoundsJson(program.upper())},
              {"rows", RowsJson(program.rows())},
              {"round", terms.round},
              {"seed", terms.seed},
              {"tolerance", terms.tolerance},
              {"settings", terms.settings}}
      .dump();
}

std::string EvaluationLine(const SlottedProgram& program, const EvaluateRequest& request, bool finite) {
  json answer = {{"type", "evaluation"}, {"id", request.id}, {"finite", finite}};
  if (finite) {
    answer["cost"] = program.value().cost;
    answer["violation"] = program.value().max_violation;
    answer["values"] = program.row_values();
  }
  if (finite && request.gradients) {
    answer["gradient"] = GradientOf(program);
    answer["jacobian"] = JacobianJson(program);
  }
  return answer.dump();
}

std::string CancelLine() { return json{{"type", "cancel"}}.dump(); }

}  // namespace legopt::external
