#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace legopt {

/// Contribution of a term to the objective (paper, (12)):
///   cost        F = sum_i r_i^2
///   equality    penalty * sum_i |r_i|
///   inequality  penalty * sum_i max(0, r_i)      (satisfied when r_i <= 0)
///   preference  weight * sum_i max(0, r_i)       with its own constant weight: desired, but subordinate to the
///                                                equalities and inequalities
enum class TermKind {
  kCost,        ///< sum of squares
  kEquality,    ///< l1 penalty on both sides
  kInequality,  ///< l1 penalty above 0
  kPreference   ///< l1 penalty above 0, with its own weight
};

/// Description of a term for optimisers: its place in the chain of waypoints, without reference to robots.
struct TermShape {
  std::string name;  ///< used in messages, e.g. "foot l_foot"
  TermKind kind = TermKind::kCost;
  int waypoint = 0;       ///< first waypoint it touches
  int num_waypoints = 1;  ///< 1, or 2: the waypoint and its successor
  int unit = -1;          ///< terms of equal unit >= 0 are sampled together, as one F_i of the paper; -1: sampled alone
  double weight = 0.0;    ///< weight of a preference, > 0; otherwise unused
};

/// Linear model of a term about the program's point: r(dx) = value + jacobian[0] dx_t (+ jacobian[1] dx_{t+1}).
///
/// Row i of `jacobian[k]` starts at row(k, i) and has `stride` doubles (tangent size rounded up to whole SIMD vectors,
/// the rest zero). Grows on demand and never shrinks, so that refilling a model allocates nothing.
class LinearModel {
 public:
  /// Sets the number of rows and sets all of them to zero. Contents are lost.
  void Reset(int rows, int tangent_size, int num_waypoints);

  /// Moves the point of expansion by dx (num_waypoints() blocks of `tangent_size`): value += jacobian dx.
  void Shift(const double* dx, int tangent_size);

  int rows() const { return rows_; }                    ///< number of rows; the capacity may be larger
  int stride() const { return stride_; }                ///< doubles from one row to the next: PaddedSize(tangent_size)
  int num_waypoints() const { return num_waypoints_; }  ///< waypoints that the rows touch, 1 or 2
  double& value(int i) { return value_[static_cast<size_t>(i)]; }       ///< r_i at the point of expansion
  double value(int i) const { return value_[static_cast<size_t>(i)]; }  ///< r_i, read-only
  /// Returns the derivatives of r_i by the k-th waypoint's tangent, stride() doubles.
  double* row(int k, int i) { return jacobian_[k].data() + static_cast<size_t>(i) * static_cast<size_t>(stride_); }
  /// Returns these derivatives, read-only.
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

/// Returns the number of doubles in a padded row of `size` entries.
constexpr int PaddedSize(int size) { return (size + 3) / 4 * 4; }

/// One term F_i of the objective: vector valued, touching one waypoint or two consecutive ones. It is evaluated at the
/// current point of its Program. Non-finite results are allowed (the optimiser rejects the point).
class Term {
 public:
  /// `shape` does not change afterwards.
  explicit Term(TermShape shape) : shape_(std::move(shape)) {}
  virtual ~Term() = default;
  Term(const Term&) = delete;
  Term& operator=(const Term&) = delete;

  const TermShape& shape() const { return shape_; }

  /// Appends the residuals r at the program's point. The number of rows may differ from point to point (contacts appear
  /// and disappear).
  void Evaluate(std::vector<double>& residuals) {
    ++evaluations_;
    ComputeResiduals(residuals);
  }

  /// Computes the linear model at the program's point; its values equal those of Evaluate.
  void Linearize(LinearModel& model) {
    ++evaluations_;
    ComputeModel(model);
  }

  /// Calls of Evaluate and Linearize so far: a cost measure that does not depend on machine or load.
  std::int64_t evaluations() const { return evaluations_; }

  /// Weight of an evaluation in Program::TermWork_ns: its typical CPU time, ns. A constant of the kind of term, so that
  /// work does not depend on machine or load. Default: that of a small term.
  virtual std::int64_t weight_ns() const { return 100; }

  /// Appends one key per row of Evaluate at the program's point. Rows with equal keys at two points are the same
  /// function of x, so that optimisers which need a fixed set of rows can track them. Default: the index, 0, 1, 2, ...
  virtual void RowKeys(int rows, std::vector<int>& keys);

  /// Relaxes `share` in [0, 1] of the term's margin from now on; 0 restores the whole margin. The margin is an
  /// additional distance beyond the task's requirements, for the sake of inexact solvers. Returns whether the term has
  /// a margin. Default: it has none.
  virtual bool RelaxMargin(double share);

  /// Disables the term (true), so that it has no rows, or enables it again. Solvers disable terms in a first descent
  /// and must enable them afterwards. Returns whether the term can be disabled: its rows appear and disappear, and its
  /// linear models hold only nearby. Default: it cannot.
  virtual bool SetDisabled(bool aside);

  /// Returns an upper bound of the rows that Evaluate leaves out (unless other rows imply them). Default: no row is
  /// left out.
  virtual double AbsentRow() const { return -std::numeric_limits<double>::infinity(); }

 private:
  virtual void ComputeResiduals(std::vector<double>& residuals) = 0;  ///< see Evaluate
  virtual void ComputeModel(LinearModel& model) = 0;                  ///< see Linearize

  TermShape shape_;
  std::int64_t evaluations_ = 0;
};

/// A nonlinear program over a chain of T waypoints, each a point on a manifold with `tangent_size` degrees of freedom.
/// It is the optimisers' only view of a task.
///
/// A workspace: it holds one point at a time and values computed from it; one thread.
class Program {
 public:
  virtual ~Program() = default;

  virtual int num_waypoints() const = 0;  ///< T, the length of the chain, >= 1
  virtual int tangent_size() const = 0;   ///< degrees of freedom per waypoint
  virtual int point_size() const = 0;     ///< numbers per waypoint
  /// Returns all terms, of fixed number and order. The program owns them; they are evaluated at its point.
  virtual const std::vector<std::unique_ptr<Term>>& terms() const = 0;

  /// Clears caches that earlier points have filled to make later ones faster. Solvers call it first, so that a solve
  /// depends on its initial guess only. Default: there are no caches.
  virtual void ClearCache() {}

  /// Moves to x (num_waypoints * point_size). Terms use the new point from their next call on.
  virtual void SetPoint(Eigen::Ref<const Eigen::VectorXd> x) = 0;

  /// Sets x_next to x moved by dx (num_waypoints * tangent_size), exactly within the bounds of the variables.
  virtual void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
                       Eigen::Ref<Eigen::VectorXd> x_next) const = 0;

  /// Converts `row`, a derivative by the tangent of one waypoint at Retract(x, dx), to the derivative by that
  /// waypoint's block `dx` (tangent_size entries each; in place; independent of x). Default: no change, for
  /// Retract = x + dx.
  virtual void PullBack(const double* dx, double* row) const;

  /// Returns the number of evaluations of all terms since the program was created.
  std::int64_t TermEvaluations() const;
  /// Returns the sum of these evaluations, each with the weight of its term, ns.
  std::int64_t TermWork_ns() const;

  /// Computes bounds of dx that keep x + dx within the variables' bounds (+-infinity where there are none; equal bounds
  /// fix a variable).
  virtual void StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                          Eigen::Ref<Eigen::VectorXd> upper) const = 0;

  /// Moves x to the nearest point within the variables' bounds.
  virtual void ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const = 0;
};

/// Terms of a WaypointView.
enum class ViewedTerms : std::uint8_t {
  kOwnConstraints,  ///< constraints that touch no other waypoint; no costs, no preferences
  kUpToWaypoint     ///< all terms that touch the waypoint alone, or it and its predecessor, which does not move
};

/// One waypoint of a program: its variables, and some of the terms that touch it. A point of the whole program is
/// feasible if and only if every view of kUpToWaypoint is, or of either kind if no constraint couples waypoints.
///
/// A workspace over the whole program, which must outlive it and whose point it changes. Evaluations count as the whole
/// program's. One thread.
class WaypointView : public Program {
 public:
  /// Views `waypoint` of `whole`, with the others as in `x` (num_waypoints * point_size of the whole).
  WaypointView(Program& whole, int waypoint, Eigen::Ref<const Eigen::VectorXd> x,
               ViewedTerms viewed = ViewedTerms::kOwnConstraints);

  int num_waypoints() const override { return 1; }
  int tangent_size() const override { return whole_->tangent_size(); }
  int point_size() const override { return whole_->point_size(); }
  /// Returns the viewed terms; the waypoint becomes waypoint 0.
  const std::vector<std::unique_ptr<Term>>& terms() const override { return terms_; }
  void ClearCache() override { whole_->ClearCache(); }
  void SetPoint(Eigen::Ref<const Eigen::VectorXd> x) override;
  void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
               Eigen::Ref<Eigen::VectorXd> x_next) const override;
  void PullBack(const double* dx, double* row) const override { whole_->PullBack(dx, row); }
  void StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                  Eigen::Ref<Eigen::VectorXd> upper) const override;
  void ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const override;

  /// Returns whether the whole program lets the waypoint move.
  bool IsFree() const;

 private:
  /// Returns the waypoint's part of a vector with `size` entries per waypoint.
  auto Part(Eigen::VectorXd& vector, int size) const {
    return vector.segment(static_cast<Eigen::Index>(waypoint_) * size, size);
  }

  Program* whole_;
  int waypoint_;
  std::vector<std::unique_ptr<Term>> terms_;
  mutable Eigen::VectorXd x_, dx_, next_, lower_, upper_;  ///< vectors of the whole program
};

}  // namespace legopt
