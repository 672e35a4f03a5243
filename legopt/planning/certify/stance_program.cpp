#include "legopt/planning/certify/stance_program.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "legopt/geometry/proximity_pair.h"
#include "legopt/problem/terms/waypoint_terms.h"

namespace legopt::certify {
namespace {

/// A term without changes.
class ForwardingTerm : public Term {
 public:
  explicit ForwardingTerm(Term& term) : Term(term.shape()), term_(&term) {}

  void RowKeys(int rows, std::vector<int>& keys) override { term_->RowKeys(rows, keys); }
  double AbsentRow() const override { return term_->AbsentRow(); }

 private:
  void ComputeResiduals(std::vector<double>& residuals) override { term_->Evaluate(residuals); }
  void ComputeModel(LinearModel& model) override { term_->Linearize(model); }

  Term* term_;
};

/// Collision either with the scene or between links: rows of the other kind are always satisfied.
class FilteredCollisionTerm : public Term {
 public:
  FilteredCollisionTerm(Term& term, WaypointState& state, bool keeps_scene)
      : Term(term.shape()), term_(&term), state_(&state), keeps_scene_(keeps_scene) {}

  void RowKeys(int rows, std::vector<int>& keys) override { term_->RowKeys(rows, keys); }
  double AbsentRow() const override { return term_->AbsentRow(); }

 private:
  bool Keeps(std::size_t row) const { return (state_->contacts()[row].link_b == kScene) == keeps_scene_; }

  void ComputeResiduals(std::vector<double>& residuals) override {
    const std::size_t first = residuals.size();
    term_->Evaluate(residuals);
    for (std::size_t i = first; i < residuals.size(); ++i) {
      if (!Keeps(i - first)) residuals[i] = AbsentRow();
    }
  }
  void ComputeModel(LinearModel& model) override {
    term_->Linearize(model);
    for (int i = 0; i < model.rows(); ++i) {
      if (Keeps(static_cast<std::size_t>(i))) continue;
      model.value(i) = AbsentRow();
      std::fill_n(model.row(0, i), model.stride(), 0.0);
    }
  }

  Term* term_;
  WaypointState* state_;
  bool keeps_scene_;
};

}  // namespace

StanceProgram::StanceProgram(const Dataset& dataset, CollisionQuery& query, const Stance& stance,
                             const ProximityOptions& proximity, ConstraintGroups left_out)
    : whole_(dataset, query, std::array{WaypointConstraints{.stance = &stance}}, proximity) {
  const bool scene = !left_out.Has(ConstraintGroup::kEnvironment);
  const bool self = !left_out.Has(ConstraintGroup::kSelf);
  for (const auto& term : whole_.terms()) {
    const bool collision = dynamic_cast<const CollisionTerm*>(term.get()) != nullptr;
    const bool balance = dynamic_cast<const ComTerm*>(term.get()) != nullptr;
    if ((balance && left_out.Has(ConstraintGroup::kBalance)) || (collision && !scene && !self)) continue;
    if (collision && scene != self) {
      terms_.push_back(std::make_unique<FilteredCollisionTerm>(*term, whole_.state(0), scene));
    } else {
      terms_.push_back(std::make_unique<ForwardingTerm>(*term));
    }
  }
}

}  // namespace legopt::certify
