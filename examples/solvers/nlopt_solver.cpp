// NLopt's SLSQP as an external solver of legopt, in one file: docs/reference/external-solvers.md describes the
// protocol. To build by hand:
//
//   g++ -std=c++17 -O2 nlopt_solver.cpp -o nlopt_solver -lnlopt_cxx -lnlopt
//
// Preferences are added to the cost: weight times the sum of max(v, 0).
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <nlopt.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using nlohmann::json;

constexpr int kProtocol = 1;
constexpr double kFarCost = 1e12, kFarRow = 1e6;  // if the program is not finite

/// Thrown if legopt's effort limit for this solve is reached.
struct Stopped {};

struct Row {
  std::string kind;
  std::size_t first = 0, size = 0;  ///< the variables that it depends on
  double weight = 0.0;              ///< weight of a preference
};

void Say(const json& message) {
  std::cout << message.dump() << std::endl;  // flushed, since legopt waits for the line
}

json Hear() {
  std::string line;
  if (!std::getline(std::cin, line)) std::exit(EXIT_SUCCESS);  // legopt has ended
  return json::parse(line);
}

/// Reads the bounds of a `solve`, in which null means `none`.
std::vector<double> ReadBounds(const json& list, double none) {
  std::vector<double> bounds;
  for (const json& bound : list) bounds.push_back(bound.is_null() ? none : bound.get<double>());
  return bounds;
}

std::vector<Row> ReadRows(const json& list) {
  std::vector<Row> rows;
  for (const json& row : list) {
    rows.push_back({row.at("kind"), row.at("first"), row.at("size"), row.value("weight", 0.0)});
  }
  return rows;
}

/// The program at the last requested point: one evaluation yields cost and all rows.
class Point {
 public:
  explicit Point(std::vector<Row> rows) : rows_(std::move(rows)) {}

  const std::vector<Row>& rows() const { return rows_; }

  /// Returns the `evaluation` at x. Throws Stopped.
  const json& At(const std::vector<double>& x) {
    if (x == x_) return evaluation_;
    x_ = x;
    Say({{"type", "evaluate"}, {"id", ++asked_}, {"x", x}, {"gradients", true}});
    evaluation_ = Hear();
    if (evaluation_.at("type") == "cancel") throw Stopped{};
    if (Finite()) {
      Say({{"type", "progress"}, {"cost", evaluation_.at("cost")}, {"violation", evaluation_.at("violation")}});
    }
    return evaluation_;
  }

  bool Finite() const { return evaluation_.at("finite"); }

 private:
  std::vector<Row> rows_;
  std::vector<double> x_;
  json evaluation_;
  int asked_ = 0;
};

// Cost including preferences; nlopt::vfunc.
double Cost(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  Point& point = *static_cast<Point*>(data);
  const json& at = point.At(x);
  if (!point.Finite()) {
    std::fill(gradient.begin(), gradient.end(), 0.0);
    return kFarCost;
  }
  double cost = at.at("cost");
  if (!gradient.empty()) gradient = at.at("gradient").get<std::vector<double>>();
  for (std::size_t i = 0; i < point.rows().size(); ++i) {
    const Row& row = point.rows()[i];
    const double value = at.at("values")[i];
    if (row.kind != "preference" || value <= 0.0) continue;
    cost += row.weight * value;
    for (std::size_t k = 0; k < row.size && !gradient.empty(); ++k) {
      gradient[row.first + k] += row.weight * at.at("jacobian")[i][k].get<double>();
    }
  }
  return cost;
}

/// The rows of one kind, as NLopt requires them.
struct Rows {
  Point* point;
  std::vector<std::size_t> chosen;  ///< indices into all rows

  Rows(Point* of, const std::string& kind) : point(of) {
    for (std::size_t i = 0; i < of->rows().size(); ++i) {
      if (of->rows()[i].kind == kind) chosen.push_back(i);
    }
  }
};

// Values and the dense Jacobian, row by row; nlopt::mfunc.
void RowValues(unsigned /*rows*/, double* values, unsigned variables, const double* x, double* jacobian, void* data) {
  const Rows& rows = *static_cast<Rows*>(data);
  const json& at = rows.point->At(std::vector<double>(x, x + variables));
  if (jacobian != nullptr) std::fill_n(jacobian, rows.chosen.size() * variables, 0.0);
  for (std::size_t k = 0; k < rows.chosen.size(); ++k) {
    const std::size_t i = rows.chosen[k];
    values[k] = rows.point->Finite() ? at.at("values")[i].get<double>() : kFarRow;
    if (jacobian == nullptr || !rows.point->Finite()) continue;
    const Row& row = rows.point->rows()[i];
    for (std::size_t j = 0; j < row.size; ++j) jacobian[k * variables + row.first + j] = at.at("jacobian")[i][j];
  }
}

nlopt::opt MakeOptimizer(const json& problem) {
  nlopt::opt optimizer(nlopt::LD_SLSQP, problem.at("variables").get<unsigned>());
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  optimizer.set_lower_bounds(ReadBounds(problem.at("lower"), -kInfinity));
  optimizer.set_upper_bounds(ReadBounds(problem.at("upper"), kInfinity));
  const json& settings = problem.at("settings");
  optimizer.set_ftol_abs(settings.value("ftol", 1e-4));
  optimizer.set_maxeval(settings.value("maxeval", 200));
  return optimizer;
}

// Returns the status for NLopt's result; SLSQP reports "roundoff" if it cannot improve further.
const char* Minimise(nlopt::opt& optimizer, std::vector<double>& x) {
  try {
    double cost = 0.0;
    return optimizer.optimize(x, cost) == nlopt::MAXEVAL_REACHED ? "limit" : "converged";
  } catch (const nlopt::roundoff_limited&) {
    return "converged";
  } catch (const Stopped&) {
    return "limit";
  } catch (const std::runtime_error&) {
    return "failed";
  }
}

// legopt considers the last point and all evaluated points, and uses the best.
json Solve(const json& problem) {
  Point point(ReadRows(problem.at("rows")));
  nlopt::opt optimizer = MakeOptimizer(problem);
  Rows equalities(&point, "equality"), inequalities(&point, "inequality");
  const double tolerance = problem.at("tolerance");
  optimizer.set_min_objective(Cost, &point);
  if (!equalities.chosen.empty()) {
    optimizer.add_equality_mconstraint(RowValues, &equalities,
                                       std::vector<double>(equalities.chosen.size(), tolerance));
  }
  if (!inequalities.chosen.empty()) {
    optimizer.add_inequality_mconstraint(RowValues, &inequalities,
                                         std::vector<double>(inequalities.chosen.size(), tolerance));
  }
  std::vector<double> x(problem.at("variables"), 0.0);
  const char* status = Minimise(optimizer, x);
  return {{"type", "solution"}, {"x", x}, {"status", status}};
}

void Serve() {
  const std::string version = std::to_string(nlopt::version_major()) + "." + std::to_string(nlopt::version_minor());
  Say({{"type", "hello"}, {"protocol", kProtocol}, {"name", "NLopt SLSQP"}, {"version", version}});
  for (;;) {
    const json line = Hear();
    if (line.at("type") == "solve") Say(Solve(line));  // the other message is a `cancel` of a solve that had ended
  }
}

}  // namespace

int main() {
  try {
    Serve();
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";  // last line of output, which legopt reports
    return EXIT_FAILURE;
  }
}
