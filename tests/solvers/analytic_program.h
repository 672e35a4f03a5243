#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "legopt/problem/program.h"

namespace legopt {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline Eigen::VectorXd One(double value) { return Eigen::VectorXd::Constant(1, value); }

/// A small nonlinear program defined by functions: a chain of waypoints in R^n, tangent = point.
class AnalyticProgram : public Program {
 public:
  /// Residuals of the concatenated waypoints that the term depends on.
  using Residuals = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

  /// Constructs a program with bounds of all waypoints together.
  AnalyticProgram(Eigen::VectorXd lower, Eigen::VectorXd upper, int num_waypoints = 1)
      : num_waypoints_(num_waypoints), lower_(std::move(lower)), upper_(std::move(upper)) {}

  /// Adds a term whose Jacobian is computed by central differences; the programs are tiny and smooth.
  void Add(TermKind kind, Residuals residuals, int unit = -1) {
    AddShaped({"function", kind, 0, 1, unit}, std::move(residuals));
  }
  /// Adds an inequality with safety margin `reserve` to a program of one waypoint.
  void AddWithMargin(Residuals residuals, double reserve) {
    terms_.push_back(std::make_unique<MarginTerm>(std::move(residuals), reserve, *this));
  }
  /// Adds a term that can be disabled.
  void AddRemovable(TermShape shape, Residuals residuals) {
    terms_.push_back(std::make_unique<RemovableTerm>(std::move(shape), std::move(residuals), *this));
  }
  /// Adds a term. `absent_row`: see Term::AbsentRow, for functions with a varying number of rows.
  void AddShaped(TermShape shape, Residuals residuals, double absent_row = -std::numeric_limits<double>::infinity()) {
    terms_.push_back(std::make_unique<FunctionTerm>(std::move(shape), std::move(residuals), absent_row, *this));
  }

  int num_waypoints() const override { return num_waypoints_; }
  int tangent_size() const override { return static_cast<int>(lower_.size()) / num_waypoints_; }
  int point_size() const override { return tangent_size(); }
  const std::vector<std::unique_ptr<Term>>& terms() const override { return terms_; }
  void SetPoint(Eigen::Ref<const Eigen::VectorXd> x) override { x_ = x; }
  void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
               Eigen::Ref<Eigen::VectorXd> x_next) const override {
    x_next = x + dx;
    ProjectOnBounds(x_next);
  }
  void StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                  Eigen::Ref<Eigen::VectorXd> upper) const override {
    lower = lower_ - x;
    upper = upper_ - x;
  }
  void ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const override { x = x.cwiseMax(lower_).cwiseMin(upper_); }

 private:
  class FunctionTerm : public Term {
   public:
    FunctionTerm(TermShape shape, Residuals residuals, double absent_row, const AnalyticProgram& program)
        : Term(std::move(shape)), residuals_(std::move(residuals)), absent_row_(absent_row), program_(program) {}
    void ComputeResiduals(std::vector<double>& values) override {
      const Eigen::VectorXd r = residuals_(Point());
      values.insert(values.end(), r.begin(), r.end());
    }
    void ComputeModel(LinearModel& model) override {
      constexpr double kStep = 1e-6;
      const Eigen::VectorXd x = Point();
      const int size = program_.tangent_size();
      const Eigen::VectorXd r = residuals_(x);
      model.Reset(static_cast<int>(r.size()), size, shape().num_waypoints);
      for (int j = 0; j < x.size(); ++j) {
        Eigen::VectorXd ahead = x, back = x;
        ahead[j] += kStep;
        back[j] -= kStep;
        const Eigen::VectorXd column = (residuals_(ahead) - residuals_(back)) / (2 * kStep);
        for (Eigen::Index i = 0; i < r.size(); ++i) {
          model.row(j / size, static_cast<int>(i))[j % size] = column[i];
        }
      }
      for (Eigen::Index i = 0; i < r.size(); ++i) model.value(static_cast<int>(i)) = r[i];
    }
    double AbsentRow() const override { return absent_row_; }

   private:
    Eigen::VectorXd Point() const {
      const Eigen::Index size = program_.tangent_size();
      return program_.x_.segment(shape().waypoint * size, shape().num_waypoints * size);
    }

    Residuals residuals_;
    double absent_row_;
    const AnalyticProgram& program_;
  };

  class MarginTerm : public FunctionTerm {
   public:
    MarginTerm(Residuals residuals, double reserve, const AnalyticProgram& program)
        : FunctionTerm(
              {"reserved", TermKind::kInequality, 0, 1, -1},
              [this, residuals = std::move(residuals)](const Eigen::VectorXd& x) -> Eigen::VectorXd {
                return residuals(x).array() + kept_;
              },
              -std::numeric_limits<double>::infinity(), program),
          safety_margin_(reserve),
          kept_(reserve) {}
    bool RelaxMargin(double share) override {
      kept_ = (1.0 - share) * safety_margin_;
      return true;
    }

   private:
    double safety_margin_, kept_;
  };

  class RemovableTerm : public FunctionTerm {
   public:
    RemovableTerm(TermShape shape, Residuals residuals, const AnalyticProgram& program)
        : FunctionTerm(
              std::move(shape),
              [this, residuals = std::move(residuals)](const Eigen::VectorXd& x) -> Eigen::VectorXd {
                return disabled_ ? Eigen::VectorXd() : residuals(x);
              },
              -std::numeric_limits<double>::infinity(), program) {}
    bool SetDisabled(bool aside) override {
      disabled_ = aside;
      return true;
    }

   private:
    bool disabled_ = false;
  };

  int num_waypoints_;
  Eigen::VectorXd lower_, upper_, x_;
  std::vector<std::unique_ptr<Term>> terms_;
};

/// Returns one waypoint in a plane, at most `limit` from the origin in each coordinate.
inline AnalyticProgram Plane(double limit = kInfinity) {
  return {Eigen::VectorXd::Constant(2, -limit), Eigen::VectorXd::Constant(2, limit)};
}

}  // namespace legopt
