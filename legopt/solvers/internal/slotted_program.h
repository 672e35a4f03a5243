#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/problem/program.h"
#include "legopt/solvers/solver.h"
#include "legopt/solvers/subproblem/convex_subproblem.h"

namespace legopt {

/// A Program about a base point x0 as a smooth program of fixed structure in dx, for optimisers that need one:
///
///     min F(dx) + sum_k w_k max(0, p_k(dx))   subject to   h_i(dx) = 0,   g_j(dx) <= 0,   lower <= dx <= upper,
///
/// with x = Retract(x0, dx), and weights w_k and rows p_k of the preferences. It is smooth except for the max, which
/// the caller must handle.
///
/// Rows of terms may appear and disappear (contacts). Each row that was present at some base point has a *slot*,
/// identified by the row's key (Term::RowKeys). While the row is absent, its slot has the value Term::AbsentRow and
/// zero derivative, which continues the row where it leaves the contact range. If rows share a key, the larger one
/// counts. A term that may leave rows out has one more slot, for the worst row without a slot of its own. Hence the
/// feasible set is exactly the program's, at every dx and for any set of slots. Only the last slot is not smooth, when
/// several new rows are violated at once. Rebase corrects that: it gives slots to the rows at the new base point.
///
/// Derivatives are with respect to dx and exact: rows are linearised at x and pulled back through the retraction
/// (Program::PullBack).
///
/// A workspace on one program, which must outlive it; one thread; Evaluate does not allocate once buffers have grown.
class SlottedProgram {
 public:
  /// Row i of the program in slots: h_i, g_i or p_i.
  struct Row {
    TermKind kind = TermKind::kEquality;  ///< equality, inequality or preference
    int first = 0;                        ///< first variable
    int size = 0;                         ///< number of variables, consecutive
    size_t begin = 0;                     ///< index of its first derivative in jacobian()
    double weight = 0.0;                  ///< weight of a preference
  };

  /// Sets the program. There are no slots yet.
  void Reset(Program& program);

  /// Makes x the base point and adds slots for the rows there. Returns whether any slot was added.
  bool Rebase(const Eigen::VectorXd& x);

  /// Evaluates at dx, unless the last call did. Returns false if anything is not finite.
  bool Evaluate(const double* dx);

  int num_variables() const { return static_cast<int>(dx_.size()); }  ///< length of dx: tangents of all waypoints
  const std::vector<Row>& rows() const { return rows_; }              ///< fixed between two calls of Rebase
  /// Bounds of dx about the base point, num_variables() entries, +-infinity where there are none.
  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }

  /// Retract(x0, dx) of the last Evaluate. All members below refer to this point; derivatives are valid if Evaluate
  /// returned true.
  const Eigen::VectorXd& x() const { return x_; }
  const ObjectiveValue& value() const { return value_; }   ///< exact value of all rows
  const ConvexSubproblem& cost() const { return *cost_; }  ///< F with gradient and Gauss-Newton matrix, about dx
  bool coupled() const { return coupled_; }                ///< the matrix may have off-diagonal blocks
  const std::vector<double>& row_values() const { return row_values_; }  ///< h_i, g_i or p_i, by row
  /// Derivatives, dense within a row's variables: Row::size numbers from index Row::begin on.
  const std::vector<double>& jacobian() const { return jacobian_; }
  /// Returns whether a row without a slot of its own is above -`tolerance`.
  bool SharedSlotActive(double tolerance) const;

 private:
  struct Slot {
    int key = 0;
    size_t row = 0;
  };
  struct TermSlots {
    std::vector<Slot> slots;  ///< sorted by key
    size_t shared = kNone;  ///< row of the slot for the worst row without a slot; kNone: the term never leaves rows out
  };
  static constexpr size_t kNone = static_cast<size_t>(-1);

  bool AddSlots();
  void LayOut();
  void PullBack(const TermShape& shape);
  void Linearize();
  void Fill(size_t k);
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
