#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "legopt/problem/terms/task_program.h"

namespace legopt {

inline constexpr double kDifferenceStep = 1e-6;
inline constexpr double kDifferenceTolerance =
    2e-6;  // rounding 1e-16 / step on values up to 20, plus h^2 times the third derivative

/// Contacts are comparable if the same pairs are found in the same order.
inline bool SamePairs(const std::vector<ProximityPair>& a, const std::vector<ProximityPair>& b) {
  if (a.size() != b.size()) return false;
  for (size_t i = 0; i < a.size(); ++i) {
    if (a[i].pair_id != b[i].pair_id) return false;
  }
  return true;
}

/// A contact whose nearest features change within the step has no derivative there.
inline bool SmoothContact(const ProximityPair& centre, const ProximityPair& moved) {
  constexpr double kFeatureJump = 1e-4;
  return (centre.normal_W - moved.normal_W).norm() < kFeatureJump &&
         (centre.point_a_W - moved.point_a_W).norm() < kFeatureJump;
}

/// Compares the derivatives of all terms of a program with central differences. Collision rows whose contact changes
/// within the step are left out.
class TermDerivatives {
 public:
  explicit TermDerivatives(WaypointProgram& program) : program_(program) {}

  int contacts_compared() const { return contacts_compared_; }

  void CheckAt(const Eigen::VectorXd& x) {
    const auto& terms = program_.terms();
    program_.SetPoint(x);
    centre_ = Contacts();
    for (size_t k = 0; k < terms.size(); ++k) {
      program_.SetPoint(x);
      LinearModel model;
      terms[k]->Linearize(model);
      std::vector<double> value;
      terms[k]->Evaluate(value);
      ASSERT_EQ(value.size(), static_cast<size_t>(model.rows())) << terms[k]->shape().name;
      ASSERT_EQ(model.num_waypoints(), terms[k]->shape().num_waypoints);
      for (int i = 0; i < model.rows(); ++i) EXPECT_EQ(model.value(i), value[static_cast<size_t>(i)]);
      for (int b = 0; b < model.num_waypoints(); ++b) CheckColumns(*terms[k], model, b, x);
    }
  }

 private:
  using AllContacts = std::vector<std::vector<ProximityPair>>;

  AllContacts Contacts() {
    AllContacts all;
    for (int t = 0; t < program_.num_waypoints(); ++t) all.push_back(program_.state(t).contacts());
    return all;
  }

  /// Returns residuals with one variable of waypoint t moved.
  std::vector<double> Moved(Term& term, int t, int j, double step, const Eigen::VectorXd& x) {
    const Eigen::Index size = program_.point_size();
    Eigen::VectorXd dx = Eigen::VectorXd::Zero(program_.tangent_size());
    dx[j] = step;
    Eigen::VectorXd moved = x, waypoint(size);
    legopt::Retract(x.segment(t * size, size), dx, waypoint);
    moved.segment(t * size, size) = waypoint;
    program_.SetPoint(moved);
    std::vector<double> residuals;
    term.Evaluate(residuals);
    return residuals;
  }

  void CheckColumns(Term& term, const LinearModel& model, int block, const Eigen::VectorXd& x) {
    const bool collision = term.shape().name == "collision";
    const int t = term.shape().waypoint + block;
    const std::vector<ProximityPair>& centre = centre_[static_cast<size_t>(t)];
    for (int j = 0; j < program_.tangent_size(); ++j) {
      const std::vector<double> ahead = Moved(term, t, j, kDifferenceStep, x);
      const std::vector<ProximityPair> contacts_ahead = program_.state(t).contacts();
      const std::vector<double> back = Moved(term, t, j, -kDifferenceStep, x);
      const std::vector<ProximityPair> contacts_back = program_.state(t).contacts();
      if (collision && (!SamePairs(centre, contacts_ahead) || !SamePairs(centre, contacts_back))) continue;
      for (int i = 0; i < model.rows(); ++i) {
        const auto r = static_cast<size_t>(i);
        if (collision &&
            (!SmoothContact(centre[r], contacts_ahead[r]) || !SmoothContact(centre[r], contacts_back[r]))) {
          continue;
        }
        contacts_compared_ += collision ? 1 : 0;
        const double difference = (ahead[r] - back[r]) / (2 * kDifferenceStep);
        EXPECT_NEAR(model.row(block, i)[j], difference, kDifferenceTolerance * std::max(1.0, std::abs(difference)))
            << term.shape().name << " of waypoint " << term.shape().waypoint << " row " << i << " variable " << j
            << " of waypoint " << t;
      }
    }
  }

  WaypointProgram& program_;
  AllContacts centre_;  ///< index: waypoint
  int contacts_compared_ = 0;
};

}  // namespace legopt
