#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace legopt {

/// What a term adds to the objective (paper, (12)):
///   cost        F = sum_i r_i^2
///   equality    penalty * sum_i |r_i|
///   inequality  penalty * sum_i max(0, r_i)      (satisfied when r_i <= 0)
///   preference  weight * sum_i max(0, r_i)       with a weight of its own that never grows: what is wished for, but
///                                                must not stand in the way of the equalities and inequalities
enum class TermKind {
  kCost,        ///< sum of squares
  kEquality,    ///< l1 penalty on both sides
  kInequality,  ///< l1 penalty above 0
  kPreference   ///< as an inequality, under its own weight
};

/// What an optimiser may know of a term: its place in the chain of waypoints, nothing of robots.
struct TermShape {
  std::string name;                 ///< for messages, e.g. "foot l_foot"
  TermKind kind = TermKind::kCost;  ///< what it adds to the objective
  int waypoint = 0;                 ///< first waypoint it touches
  int num_waypoints = 1;            ///< 1, or 2: the waypoint and its successor
  int unit = -1;        ///< terms of equal unit >= 0 are sampled together, as one F_i of the paper; -1: on its own
  double weight = 0.0;  ///< of a preference, > 0; others: unused
};

/// Linear model of a term about the program's point: r(dx) = value + jacobian[0] dx_t (+ jacobian[1] dx_{t+1}).
///
/// Row i of `jacobian[k]` starts at row(k, i) and has `stride` doubles (tangent size rounded up to whole SIMD vectors,
/// the rest zero). Grows on demand and never shrinks, so that a model that is refilled allocates nothing.
class LinearModel {
 public:
  /// Makes room for `rows` rows and zeroes them. Contents are lost.
  void Reset(int rows, int tangent_size, int num_waypoints);

  /// Moves the point of expansion by dx (num_waypoints() blocks of `tangent_size`): value += jacobian dx.
  void Shift(const double* dx, int tangent_size);

  int rows() const { return rows_; }                    ///< rows of the model, which may be fewer than it has room for
  int stride() const { return stride_; }                ///< doubles from one row to the next: PaddedSize(tangent_size)
  int num_waypoints() const { return num_waypoints_; }  ///< waypoints that the rows touch, 1 or 2
  double& value(int i) { return value_[static_cast<size_t>(i)]; }       ///< r_i at the point of expansion
  double value(int i) const { return value_[static_cast<size_t>(i)]; }  ///< the same, for reading
  /// Derivatives of r_i by the k-th waypoint's tangent, stride() doubles.
  double* row(int k, int i) { return jacobian_[k].data() + static_cast<size_t>(i) * static_cast<size_t>(stride_); }
  /// The same, for reading.
  const double* row(int k, int i) const {
    return jacobian_[k].data() + static_cast<size_t>(i) * static_cast<size_t>(stride_);
  }

 private:
  int rows_ = 0;
  int stride_ = 0;
  int num_waypoints_ = 1;
  std::vector<double> value_;
  std::vector<double> jacobian_[2];
};

/// Doubles in a padded row of `size` entries.
constexpr int PaddedSize(int size) { return (size + 3) / 4 * 4; }

/// One term F_i of the objective: vector valued, touching one waypoint or two consecutive ones. It reads the point that
/// its Program holds. Non-finite results are allowed (the optimiser rejects the point).
class Term {
 public:
  /// `shape` says where the term stands; it does not change afterwards.
  explicit Term(TermShape shape) : shape_(std::move(shape)) {}
  virtual ~Term() = default;
  Term(const Term&) = delete;
  Term& operator=(const Term&) = delete;

  const TermShape& shape() const { return shape_; }  ///< as given at construction

  /// Appends the residuals r at the program's point. The number of rows may differ from point to point (contacts come
  /// and go).
  void Evaluate(std::vector<double>& residuals) {
    ++evaluations_;
    ComputeResiduals(residuals);
  }

  /// Linear model at the program's point; its values equal those of Evaluate.
  void Linearize(LinearModel& model) {
    ++evaluations_;
    ComputeModel(model);
  }

  /// Calls of Evaluate and Linearize so far: what a solver has cost, on any machine and under any load.
  std::int64_t evaluations() const { return evaluations_; }

  /// Appends one key per row of Evaluate at the program's point. Rows of equal key at two points are the same function
  /// of x, so that optimisers which need a fixed set of rows can follow them. Default: the place, 0, 1, 2, ...
  virtual void RowKeys(int rows, std::vector<int>& keys);

  /// This share of what the term keeps in reserve beyond what its task demands, as a distance for the sake of inexact
  /// solvers, is spent from now on: in [0, 1], 0 keeps all of it. Whether there is any. Default: there is none.
  virtual bool SpendReserve(double share);

  /// Without rows from now on (true), for a first descent, or with them again, which solvers see to at its end. Whether
  /// the term lends itself to that: its rows come and go, their linear models hold only nearby. Default: it does not.
  virtual bool SetAside(bool aside);

  /// Rows that Evaluate leaves out are below this (or implied by rows that it gives). Default: none is ever left out.
  virtual double AbsentRow() const { return -std::numeric_limits<double>::infinity(); }

 private:
  virtual void ComputeResiduals(std::vector<double>& residuals) = 0;  ///< as Evaluate
  virtual void ComputeModel(LinearModel& model) = 0;                  ///< as Linearize

  TermShape shape_;
  std::int64_t evaluations_ = 0;
};

/// A nonlinear program over a chain of T waypoints, each a point on a manifold with `tangent_size` degrees of freedom.
/// It is the optimisers' only view of a task.
///
/// A workspace: it holds one point at a time and what is computed from it; one thread.
class Program {
 public:
  virtual ~Program() = default;

  virtual int num_waypoints() const = 0;  ///< T, the length of the chain, >= 1
  virtual int tangent_size() const = 0;   ///< per waypoint
  virtual int point_size() const = 0;     ///< per waypoint
  /// All terms, of fixed number and order. Owned by the program; they read its point.
  virtual const std::vector<std::unique_ptr<Term>>& terms() const = 0;

  /// Forgets what earlier points have left behind to make later ones faster. Solvers begin with it, so that a solve
  /// hangs on its start alone. Default: there is nothing.
  virtual void Forget() {}

  /// Moves to x (num_waypoints * point_size). Terms see it at their next call.
  virtual void SetPoint(Eigen::Ref<const Eigen::VectorXd> x) = 0;

  /// x_next = x moved by dx (num_waypoints * tangent_size), kept within the bounds of the variables exactly.
  virtual void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
                       Eigen::Ref<Eigen::VectorXd> x_next) const = 0;

  /// Turns `row`, a derivative by the tangent of one waypoint at Retract(x, dx), into the derivative by that waypoint's
  /// block `dx` (tangent_size entries each; in place; independent of x). Default: nothing, for Retract = x + dx.
  virtual void PullBack(const double* dx, double* row) const;

  /// Evaluations of all terms since the program was made.
  std::int64_t TermEvaluations() const;

  /// Bounds of dx that keep x + dx within the variables' bounds (+-infinity where there are none; equal bounds fix a
  /// variable).
  virtual void StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                          Eigen::Ref<Eigen::VectorXd> upper) const = 0;

  /// Moves x to the nearest point within the variables' bounds.
  virtual void ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const = 0;
};

}  // namespace legopt
