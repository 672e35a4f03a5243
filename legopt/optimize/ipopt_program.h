#pragma once

#include <IpTNLP.hpp>
#include <exception>

#include "legopt/optimize/slotted_program.h"
#include "legopt/optimize/solver.h"

namespace legopt {

/// A SlottedProgram as Ipopt wants to see it, and a watch over the solve: it asks the stop check, records the history
/// and remembers the best point. Variables are dx, starting at zero, and for each row p of a preference its excess s:
/// p - s <= 0, s >= 0, and weight s in the objective.
class IpoptProgram : public Ipopt::TNLP {
 public:
  using Index = Ipopt::Index;
  using Number = Ipopt::Number;

  /// What the solve is to know besides the problem.
  struct Settings {
    double tolerance = 0.0;  ///< violation from which on a point is infeasible
    double band = 0.0;       ///< half width that replaces each equality; 0 for true equalities
    double damping = 0.0;    ///< added to the diagonal of the Gauss-Newton matrix
  };

  /// All must outlive the solve.
  IpoptProgram(SlottedProgram& slotted, const SolverContext& context, const Settings& settings);

  /// Best point met: feasible before infeasible, then lower cost or smaller violation.
  const Eigen::VectorXd& best_x() const { return best_x_; }
  const ObjectiveValue& best_value() const { return best_value_; }
  const Eigen::VectorXd& last_dx() const { return last_dx_; }  ///< where Ipopt ended; the step alone
  int iterations() const { return iterations_; }
  SolveStatus stop_status() const { return stop_status_; }
  /// Throws what a term or the stop check threw.
  void Rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hessian, IndexStyleEnum& style) override;
  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l, Number* g_u) override;
  bool get_starting_point(Index n, bool init_x, Number* x, bool init_z, Number* z_l, Number* z_u, Index m,
                          bool init_lambda, Number* lambda) override;
  bool eval_f(Index n, const Number* x, bool new_x, Number& value) override;
  bool eval_grad_f(Index n, const Number* x, bool new_x, Number* gradient) override;
  bool eval_g(Index n, const Number* x, bool new_x, Index m, Number* g) override;
  bool eval_jac_g(Index n, const Number* x, bool new_x, Index m, Index entries, Index* rows, Index* columns,
                  Number* values) override;
  bool eval_h(Index n, const Number* x, bool new_x, Number factor, Index m, const Number* lambda, bool new_lambda,
              Index entries, Index* rows, Index* columns, Number* values) override;
  bool intermediate_callback(Ipopt::AlgorithmMode mode, Index iteration, Number objective, Number inf_pr, Number inf_du,
                             Number mu, Number d_norm, Number regularization, Number alpha_du, Number alpha_pr,
                             Index trials, const Ipopt::IpoptData* data,
                             Ipopt::IpoptCalculatedQuantities* quantities) override;
  void finalize_solution(Ipopt::SolverReturn status, Index n, const Number* x, const Number* z_l, const Number* z_u,
                         Index m, const Number* g, const Number* lambda, Number objective, const Ipopt::IpoptData* data,
                         Ipopt::IpoptCalculatedQuantities* quantities) override;

 private:
  bool Evaluate(const Number* x);
  void NoteBest();
  bool Better(const ObjectiveValue& a, const ObjectiveValue& b) const;

  SlottedProgram& slotted_;
  std::vector<size_t> preferred_;  ///< rows of preferences, in the order of their excesses
  const SolverContext& context_;
  Settings settings_;
  Eigen::VectorXd best_x_, last_dx_;
  ObjectiveValue best_value_;
  int iterations_ = 0;
  SolveStatus stop_status_ = SolveStatus::kNotRun;
  std::exception_ptr error_;
};

}  // namespace legopt
