#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/optimize/penalty_objective.h"
#include "legopt/program/program.h"
#include "legopt/subproblem/convex_subproblem.h"

namespace legopt {

/// A Program about a base point x0 as a smooth program of fixed structure in dx, for optimisers that need one:
///
///     min F(dx) + sum_k w_k max(0, p_k(dx))   subject to   h_i(dx) = 0,   g_j(dx) <= 0,   lower <= dx <= upper,
///
/// with x = Retract(x0, dx), and w_k, p_k of the preferences: smooth but for the max, which is the reader's to treat.
///
/// Rows of terms may come and go (contacts). Each row that was present at some base point has a *slot*, found by its
/// key (Term::RowKeys); while it is absent the slot is at Term::AbsentRow with zero derivative, which continues the row
/// where it leaves the contact range; of rows that share a key the larger counts. A term that leaves rows out has one
/// more slot, for the worst row without a slot of its own. Hence the feasible set is exactly the program's, at every dx
/// and whichever slots exist; what is lost is smoothness, in the last slot when several new rows are violated at once.
/// Rebase cures that: it gives slots to the rows at the new base point.
///
/// Derivatives are by dx, exactly: rows are linearised at x and pulled back through the retraction (Program::PullBack).
///
/// A workspace on one program, which must outlive its use; one thread; no allocation in Evaluate once grown.
class SlottedProgram {
 public:
  /// Row i of the program in slots: h_i, g_i or p_i.
  struct Row {
    TermKind kind = TermKind::kEquality;  ///< equality, inequality or preference
    int first = 0;                        ///< first variable
    int size = 0;                         ///< number of variables, consecutive
    size_t begin = 0;                     ///< of the derivatives in jacobian()
    double weight = 0.0;                  ///< of a preference
  };

  /// For a program; no slots yet.
  void Reset(Program& program);

  /// Makes x the base point and gives slots to the rows there. True when there were rows without one.
  bool Rebase(const Eigen::VectorXd& x);

  /// Evaluates at dx unless that is where it is. False when anything is not finite.
  bool Evaluate(const double* dx);

  int num_variables() const { return static_cast<int>(dx_.size()); }  ///< length of dx: all waypoints' tangents
  const std::vector<Row>& rows() const { return rows_; }              ///< fixed between two calls of Rebase
  /// Bounds of dx about the base point, num_variables() entries, +-infinity where there are none.
  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }  ///< likewise

  /// Retract(x0, dx) of the last Evaluate. All that follows holds there, derivatives only if it returned true.
  const Eigen::VectorXd& x() const { return x_; }
  const ObjectiveValue& value() const { return value_; }   ///< exact, of all rows
  const ConvexSubproblem& cost() const { return *cost_; }  ///< F, its gradient and Gauss-Newton matrix at dx = "0"
  bool coupled() const { return coupled_; }                ///< the matrix may have blocks off the diagonal
  const std::vector<double>& row_values() const { return row_values_; }  ///< h_i, g_i or p_i, by row
  /// Dense within a row's variables: Row::size numbers from Row::begin on.
  const std::vector<double>& jacobian() const { return jacobian_; }
  /// A row without a slot of its own is violated or nearer to that than `tolerance`.
  bool SharedSlotActive(double tolerance) const;

 private:
  struct Slot {
    int key = 0;
    size_t row = 0;
  };
  struct TermSlots {
    std::vector<Slot> slots;  ///< ascending keys
    size_t shared = kNone;    ///< row of the worst row without a slot; kNone: the term never leaves rows out
  };
  static constexpr size_t kNone = static_cast<size_t>(-1);

  bool AddSlots();
  void LayOut();
  void PullBack(const TermShape& shape);
  void Linearize();
  void Fill(size_t k);  // term k
  void Put(size_t row, int model_row);
  bool IsFinite() const;

  Program* program_ = nullptr;
  std::vector<TermSlots> term_slots_;
  std::vector<Row> rows_;
  std::unique_ptr<ConvexSubproblem> cost_;
  bool coupled_ = false;
  bool evaluated_ = false, finite_ = false;
  ObjectiveValue value_;
  Eigen::VectorXd base_, dx_, x_, lower_, upper_;
  std::vector<double> row_values_, absent_, jacobian_, scratch_;
  std::vector<int> keys_;
  LinearModel model_;
};

}  // namespace legopt
