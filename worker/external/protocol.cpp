#include "worker/external/protocol.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/printable.h"
#include "legopt/input/json.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/robot/configuration.h"
#include "legopt/types/input_error.h"
#include "worker/external/line_channel.h"

namespace legopt::external {
namespace {

using nlohmann::json;

constexpr int kDeepest = 3;              // {"waypoints": [[..]]}
constexpr std::size_t kShownBytes = 80;  // part of a line shown in a fault
constexpr std::size_t kMaxNameBytes = 200;
constexpr std::pair<std::string_view, ReportedStatus> kClaims[] = {
    {"converged", ReportedStatus::kConverged}, {"limit", ReportedStatus::kLimit}, {"failed", ReportedStatus::kFailed}};

std::string Excerpt(std::string_view line) {
  const bool cut = line.size() > kShownBytes;
  return "'" + app::Printable(std::string(line.substr(0, kShownBytes))) + (cut ? "...'" : "'");
}

// Throws SolverFault if the text is no JSON object of the protocol; `what` names it.
json ParseMessage(std::string_view text, const std::string& what) {
  std::string why;
  try {
    json message = ParseJson(text, what, {.bytes = kMaxLineBytes, .depth = kDeepest});
    if (message.is_object()) return message;
    why = "it is no object";
  } catch (const InputError& error) {
    why = error.fault().message;
    if (!error.fault().field.empty()) why = error.fault().field + ": " + why;
  }
  throw SolverFault(what + " that is no JSON object of the protocol (NaN and Infinity are no JSON): " + Excerpt(text) +
                    "; " + why);
}

/// Fields of one message, with its type for faults.
class MessageFields {
 public:
  explicit MessageFields(std::string_view line) {
    object_ = ParseMessage(line, "sent a line");
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
    const std::string value = Dump(object_.at(key));
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

  bool Has(const char* key) const { return object_.contains(key); }

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
    return Numbers(key, values);
  }

  std::vector<Eigen::VectorXd> Vectors(const char* key) const {
    std::vector<Eigen::VectorXd> vectors;
    if (!Get(key).is_array()) Refuse(key, "a list of lists of numbers");
    for (const json& values : Get(key)) {
      if (!values.is_array()) Refuse(key, "a list of lists of numbers");
      vectors.push_back(Numbers(key, values));
    }
    return vectors;
  }

  ReportedStatus Status(const char* key) const {
    const std::string word = Name(key);
    for (const auto& [known, claim] : kClaims) {
      if (word == known) return claim;
    }
    Refuse(key, "one of converged, limit, failed");
  }

 private:
  Eigen::VectorXd Numbers(const char* key, const json& values) const {
    Eigen::VectorXd vector(static_cast<Eigen::Index>(values.size()));
    for (std::size_t i = 0; i < values.size(); ++i) {
      const json& value = values[i];
      if (!value.is_number() || !std::isfinite(value.get<double>())) Refuse(key, "a list of finite numbers");
      vector[static_cast<Eigen::Index>(i)] = value.get<double>();
    }
    return vector;
  }

  json object_;
  std::string type_;
};

Hello ReadHello(const MessageFields& fields) {
  if (fields.Integer("protocol") != kProtocol) fields.Refuse("protocol", std::to_string(kProtocol));
  return {fields.Name("name"), fields.Name("version")};
}

std::vector<double> Start(int num_variables) { return std::vector<double>(static_cast<std::size_t>(num_variables)); }

SolutionReport ReadSolution(const MessageFields& fields, int num_variables) {
  if (!fields.Has("waypoints")) return {fields.Vector("x", num_variables), fields.Status("status"), {}};
  if (fields.Has("x")) throw SolverFault("sent 'solution' with both 'x' and 'waypoints'");
  return {{}, fields.Status("status"), fields.Vectors("waypoints")};
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
    return EvaluateRequest{fields.Integer("id"), fields.Vector("x", num_variables), fields.Boolean("gradients"),
                           fields.Has("contacts") && fields.Boolean("contacts")};
  }
  if (fields.type() == "progress") return ProgressReport{fields.Number("cost"), fields.Number("violation")};
  if (fields.type() == "solution") return ReadSolution(fields, num_variables);
  throw SolverFault("sent a message of the unknown type " + Excerpt(fields.type()));
}

std::string SolveLine(const SlottedProgram& program, int num_waypoints, const SolveTerms& terms) {
  json line = {{"type", "solve"},
               {"protocol", kProtocol},
               {"variables", program.num_variables()},
               {"waypoints", num_waypoints},
               {"lower", BoundsJson(program.lower())},
               {"upper", BoundsJson(program.upper())},
               {"rows", RowsJson(program.rows())},
               {"round", terms.round},
               {"seed", terms.seed},
               {"tolerance", terms.tolerance},
               {"settings", terms.settings}};
  if (!terms.robot.is_null()) line["robot"] = terms.robot;
  if (!terms.at_start.is_null()) line["at_start"] = terms.at_start;
  return Dump(line);
}

json EvaluationJson(const SlottedProgram& program, const EvaluateRequest& request, bool finite, json contacts) {
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
  if (finite && request.contacts) answer["contacts"] = std::move(contacts);
  return answer;
}

std::string CancelLine() { return Dump(json{{"type", "cancel"}}); }

std::string HelloLine(const std::string& name) {
  return Dump(json{{"type", "hello"}, {"protocol", kProtocol}, {"name", name}, {"version", ""}});
}

std::string SolutionLine(std::string_view file, int num_variables) {
  json solution = ParseMessage(file, "left a solution file");
  solution["type"] = "solution";
  solution.emplace("status", "converged");
  const bool pointless = !solution.contains("x") && !solution.contains("waypoints");
  if (pointless && solution["status"] == "failed") solution["x"] = Start(num_variables);
  return Dump(solution);
}

std::string StoppedLine(int num_variables) {
  return Dump(json{{"type", "solution"}, {"x", Start(num_variables)}, {"status", "limit"}});
}

namespace {

json VectorJson(const Eigen::Vector3d& vector) { return std::array<double, 3>{vector.x(), vector.y(), vector.z()}; }

// Null for the scene.
json LinkJson(const RobotModel& robot, int link) {
  return link == kScene ? json() : json(robot.links()[static_cast<std::size_t>(link)].name);
}

json ContactJson(const RobotModel& robot, int waypoint, const ProximityPair& contact) {
  return {{"waypoint", waypoint},
          {"link", LinkJson(robot, contact.link_a)},
          {"other", LinkJson(robot, contact.link_b)},
          {"distance", contact.distance_m},
          {"depth", std::max(0.0, -contact.distance_m)},
          {"point", VectorJson(contact.point_a_W)},
          {"other_point", VectorJson(contact.point_b_W)},
          {"normal", VectorJson(contact.normal_W)}};
}

json ContactTargetJson(const Dataset& dataset, const ContactTarget& target) {
  const Contact& contact = dataset.contact(target.contact);
  if (contact.facts().free_rotation == FreeRotation::kAll) {
    return {{"link", contact.link},
            {"kind", ToString(contact.kind)},
            {"point", VectorJson(contact.X_LC.translation())},
            {"position", VectorJson(contact.OriginTarget(target))}};
  }
  if (contact.facts().free_rotation != FreeRotation::kNone) {
    const Eigen::Quaterniond in_link(contact.X_LC.linear()), in_world = target.rotation.normalized();
    return {{"link", contact.link},
            {"kind", ToString(contact.kind)},
            {"point", VectorJson(contact.X_LC.translation())},
            {"orientation", {in_link.w(), in_link.x(), in_link.y(), in_link.z()}},
            {"position", VectorJson(contact.OriginTarget(target))},
            {"rotation", {in_world.w(), in_world.x(), in_world.y(), in_world.z()}},
            {"slide", contact.SlideOf(target)}};
  }
  const Eigen::Isometry3d X_WL = contact.LinkTarget(target);
  const Eigen::Quaterniond rotation(X_WL.linear());
  return {{"link", contact.link},
          {"position", VectorJson(X_WL.translation())},
          {"rotation", {rotation.w(), rotation.x(), rotation.y(), rotation.z()}}};
}

json JointNames(const RobotModel& robot) {
  json names = json::array();
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    names.push_back(robot.joints()[static_cast<std::size_t>(robot.dof_joint(dof))].name);
  }
  return names;
}

// Writes the tangent from one configuration to the other, by the shorter rotation: the inverse of Retract.
void WriteTangent(Eigen::Ref<const Eigen::VectorXd> from, Eigen::Ref<const Eigen::VectorXd> to,
                  Eigen::Ref<Eigen::VectorXd> dx) {
  const auto start = PartsOf(from), goal = PartsOf(to);
  const auto step = MutableTangentPartsOf(dx);
  step.linear() = goal.linear() - start.linear();
  const Eigen::Quaterniond end = goal.base_quaternion();
  if (!(end.norm() > 0.0)) throw SolverFault("sent a waypoint whose quaternion is zero");
  Eigen::Quaterniond turn = end.normalized() * start.base_rotation().conjugate();
  if (turn.w() < 0.0) turn.coeffs() *= -1.0;
  const Eigen::AngleAxisd rotation(turn);
  step.base_rotation() = rotation.angle() * rotation.axis();
}

}  // namespace

json ContactsJson(Program& program) {
  json list = json::array();
  auto* chain = dynamic_cast<WaypointProgram*>(&program);
  if (chain == nullptr) return list;
  for (int waypoint = 0; waypoint < chain->num_waypoints(); ++waypoint) {
    for (const ProximityPair& contact : chain->state(waypoint).contacts()) {
      list.push_back(ContactJson(chain->robot(), waypoint, contact));
    }
  }
  return list;
}

json RobotJson(const Program& program, const Eigen::VectorXd& x) {
  const auto* chain = dynamic_cast<const WaypointProgram*>(&program);
  if (chain == nullptr) return {};
  const Dataset& dataset = chain->dataset();
  json start = json::array(), footholds = json::array();
  for (int waypoint = 0; waypoint < chain->num_waypoints(); ++waypoint) {
    const Eigen::VectorXd at = x.segment(Eigen::Index{waypoint} * chain->point_size(), chain->point_size());
    start.push_back(std::vector<double>(at.begin(), at.end()));
    json feet = json::array();
    for (const ContactTarget& target : chain->stance(waypoint).contacts)
      feet.push_back(ContactTargetJson(dataset, target));
    footholds.push_back(std::move(feet));
  }
  return {{"dataset", dataset.folder().string()},
          {"urdf", dataset.robot_file().string()},
          {"joints", JointNames(chain->robot())},
          {"start", std::move(start)},
          {"footholds", std::move(footholds)}};
}

Eigen::VectorXd TangentTo(const Program& program, const Eigen::VectorXd& x,
                          const std::vector<Eigen::VectorXd>& waypoints) {
  const auto* chain = dynamic_cast<const WaypointProgram*>(&program);
  if (chain == nullptr) throw SolverFault("sent 'waypoints' where there is no robot: 'x' is asked for");
  const Eigen::Index size = chain->point_size(), tangent = chain->tangent_size();
  const auto fits = [&](const Eigen::VectorXd& waypoint) { return waypoint.size() == size; };
  if (std::ssize(waypoints) != chain->num_waypoints() || !std::ranges::all_of(waypoints, fits)) {
    throw SolverFault("sent other 'waypoints' than " + std::to_string(chain->num_waypoints()) + " of " +
                      std::to_string(size) + " numbers");
  }
  Eigen::VectorXd dx(tangent * chain->num_waypoints());
  for (Eigen::Index t = 0; t < chain->num_waypoints(); ++t) {
    WriteTangent(x.segment(t * size, size), waypoints[static_cast<std::size_t>(t)], dx.segment(t * tangent, tangent));
  }
  return dx;
}

}  // namespace legopt::external
