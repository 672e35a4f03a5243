// A custom term: a posture whose pelvis stays below a height, as under a beam: own_term DATASET
#include <algorithm>
#include <cstdio>
#include <memory>

#include "legopt/geometry/collision_query.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/solvers/solver.h"
#include "legopt/types/input_error.h"

namespace {

// Inequality: z of the root link's frame minus the height, m; satisfied if <= 0.
class BelowTerm : public legopt::Term {
 public:
  BelowTerm(legopt::WaypointState& state, double height_m)
      : Term({"below the beam", legopt::TermKind::kInequality}), state_(&state), height_m_(height_m) {}

  void ComputeResiduals(std::vector<double>& residuals) override {
    residuals.push_back(state_->kinematics().link_pose(kRoot).translation().z() - height_m_);
  }

  void ComputeModel(legopt::LinearModel& model) override {
    const legopt::Kinematics& kinematics = state_->kinematics();
    const Eigen::Vector3d point_W = kinematics.link_pose(kRoot).translation();
    model.Reset(1, kinematics.model().tangent_size(), 1);
    model.value(0) = point_W.z() - height_m_;
    kinematics.AddPointGradient(kRoot, point_W, Eigen::Vector3d::UnitZ(), 1.0, model.row(0, 0));
  }

 private:
  static constexpr int kRoot = 0;
  legopt::WaypointState* state_;
  double height_m_;
};

// Returns the height of the root link in a posture below the beam, if one is found.
double RootHeight(const legopt::Dataset& dataset, const legopt::ProblemDefinition& problem, double beam_m) {
  const legopt::Method method = legopt::Method::Of("sqp");
  legopt::CollisionQuery query(dataset.collision_model(method.collision, method.pairs));
  const auto program =
      legopt::MakeTaskProgram(legopt::Task::kPosture, dataset, query, problem.stances,
                              {.margin_m = method.collision_margin_m, .range_m = method.contact_range_m});
  program->Append(std::make_unique<BelowTerm>(program->state(0), beam_m));
  Eigen::VectorXd x = InitialGuess(dataset, problem.stances.front(), legopt::Initialization::kGood);
  const legopt::SolverResult result = MakeSolver(method)->Solve(*program, x, {});
  program->SetPoint(x);
  const double height_m = program->state(0).kinematics().link_pose(0).translation().z();
  std::printf("beam at %.3f m: %s, root link at %.3f m\n", beam_m, ToString(result.status).data(), height_m);
  return result.feasible ? height_m : 1e9;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: own_term DATASET\n");
    return 2;
  }
  try {
    const auto dataset = legopt::Dataset::Load(argv[1]);
    const legopt::ProblemDefinition& problem = dataset->problems(legopt::Task::kPosture).front();
    const double free_m = RootHeight(*dataset, problem, 1e3);
    const double beam_m = free_m - 0.05;
    return RootHeight(*dataset, problem, beam_m) <= beam_m + 1e-3 ? 0 : 1;
  } catch (const legopt::InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
