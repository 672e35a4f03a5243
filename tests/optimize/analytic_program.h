#pragma once

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "legopt/problem/program.h"

namespace legopt {

/// A small nonlinear program in R^n given by functions: one waypoint, tangent = point.
class AnalyticProgram : public Program {
 public:
  using Residuals = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

  AnalyticProgram(Eigen::VectorXd lower, Eigen::VectorXd upper) : lower_(std::move(lower)), upper_(std::move(upper)) {}

  /// Jacobians by central differences: the programs are tiny and smooth.
  void Add(TermKind kind, Residuals residuals, int unit = -1) {
    terms_.push_back(std::make_unique<FunctionTerm>(kind, std::move(residuals), x_, unit));
  }

  int num_waypoints() const override { return 1; }
  int tangent_size() const override { return static_cast<int>(lower_.size()); }
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
    FunctionTerm(TermKind kind, Residuals residuals, const Eigen::VectorXd& x, int unit)
        : Term({"function", kind, 0, 1, unit}), residuals_(std::move(residuals)), x_(x) {}
    void Evaluate(std::vector<double>& values) override {
      const Eigen::VectorXd r = residuals_(x_);
      values.insert(values.end(), r.begin(), r.end());
    }
    void Linearize(LinearModel& model) override {
      constexpr double kStep = 1e-6;
      const Eigen::VectorXd r = residuals_(x_);
      model.Reset(static_cast<int>(r.size()), static_cast<int>(x_.size()), 1);
      for (Eigen::Index j = 0; j < x_.size(); ++j) {
        Eigen::VectorXd ahead = x_, back = x_;
        ahead[j] += kStep;
        back[j] -= kStep;
        const Eigen::VectorXd column = (residuals_(ahead) - residuals_(back)) / (2 * kStep);
        for (Eigen::Index i = 0; i < r.size(); ++i) model.row(0, static_cast<int>(i))[j] = column[i];
      }
      for (Eigen::Index i = 0; i < r.size(); ++i) model.value(static_cast<int>(i)) = r[i];
    }

   private:
    Residuals residuals_;
    const Eigen::VectorXd& x_;
  };

  Eigen::VectorXd lower_, upper_, x_;
  std::vector<std::unique_ptr<Term>> terms_;
};

}  // namespace legopt
