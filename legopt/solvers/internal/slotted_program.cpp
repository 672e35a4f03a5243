#include "legopt/solvers/internal/slotted_program.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace legopt {

void SlottedProgram::Reset(Program& program) {
  program_ = &program;
  term_slots_.assign(program.terms().size(), {});
  if (cost_ == nullptr || cost_->num_blocks() != program.num_waypoints() ||
      cost_->block_size() != program.tangent_size()) {
    cost_ = std::make_unique<ConvexSubproblem>(program.num_waypoints(), program.tangent_size());
  }
  coupled_ = false;
  for (const auto& term : program.terms()) {
    if (term->shape().kind == TermKind::kCost && term->shape().num_waypoints > 1) coupled_ = true;
  }
  const Eigen::Index tangent = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  for (auto* v : {&dx_, &lower_, &upper_}) v->setZero(tangent);
  x_.setZero(static_cast<Eigen::Index>(program.num_waypoints()) * program.point_size());
}

bool SlottedProgram::Rebase(const Eigen::VectorXd& x) {
  base_ = x;
  program_->StepBounds(x, lower_, upper_);
  program_->SetPoint(x);
  const bool grown = AddSlots();
  LayOut();
  evaluated_ = false;
  return grown;
}

bool SlottedProgram::AddSlots() {
  bool grown = false;
  for (size_t k = 0; k < term_slots_.size(); ++k) {
    Term& term = *program_->terms()[k];
    if (term.shape().kind == TermKind::kCost) continue;
    scratch_.clear();
    term.Evaluate(scratch_);
    keys_.clear();
    term.RowKeys(static_cast<int>(scratch_.size()), keys_);
    std::vector<Slot>& slots = term_slots_[k].slots;
    for (const int key : keys_) {
      const auto place = std::ranges::lower_bound(slots, key, {}, &Slot::key);
      if (place != slots.end() && place->key == key) continue;
      slots.insert(place, {key, 0});
      grown = true;
    }
  }
  return grown;
}

void SlottedProgram::LayOut() {
  rows_.clear();
  absent_.clear();
  size_t begin = 0;
  for (size_t k = 0; k < term_slots_.size(); ++k) {
    const Term& term = *program_->terms()[k];
    const TermShape& shape = term.shape();
    if (shape.kind == TermKind::kCost) continue;
    const int size = program_->tangent_size();
    const bool inequality = shape.kind != TermKind::kEquality;
    const double absent = inequality ? std::max(term.AbsentRow(), -1.0) : 0.0;
    const auto add_row = [&] {
      rows_.push_back({shape.kind, shape.waypoint * size, shape.num_waypoints * size, begin, shape.weight});
      absent_.push_back(absent);
      begin += static_cast<size_t>(rows_.back().size);
      return rows_.size() - 1;
    };
    for (Slot& slot : term_slots_[k].slots) slot.row = add_row();
    if (inequality && std::isfinite(term.AbsentRow())) term_slots_[k].shared = add_row();
  }
  row_values_.assign(rows_.size(), 0.0);
  jacobian_.assign(begin, 0.0);
}

bool SlottedProgram::Evaluate(const double* dx) {
  const Eigen::Map<const Eigen::VectorXd> at(dx, dx_.size());
  if (evaluated_ && at == dx_) return finite_;
  dx_ = at;
  evaluated_ = true;
  finite_ = false;
  if (!dx_.allFinite()) return false;
  program_->Retract(base_, dx_, x_);
  value_ = EvaluateObjective(*program_, x_, scratch_);
  if (!value_.IsFinite()) return false;
  Linearize();
  finite_ = IsFinite();
  return finite_;
}

void SlottedProgram::Linearize() {
  cost_->Clear();
  row_values_ = absent_;
  std::fill(jacobian_.begin(), jacobian_.end(), 0.0);
  for (size_t k = 0; k < term_slots_.size(); ++k) {
    Term& term = *program_->terms()[k];
    term.Linearize(model_);
    PullBack(term.shape());
    if (term.shape().kind == TermKind::kCost) {
      cost_->AddCost(term.shape().waypoint, model_);
    } else {
      Fill(k);
    }
  }
}

void SlottedProgram::PullBack(const TermShape& shape) {
  const int size = program_->tangent_size();
  for (int b = 0; b < shape.num_waypoints; ++b) {
    const double* dx = dx_.data() + static_cast<Eigen::Index>(shape.waypoint + b) * size;
    for (int i = 0; i < model_.rows(); ++i) program_->PullBack(dx, model_.row(b, i));
  }
}

void SlottedProgram::Fill(size_t k) {
  const TermSlots& term_slots = term_slots_[k];
  keys_.clear();
  program_->terms()[k]->RowKeys(model_.rows(), keys_);
  const bool varies = term_slots.shared != kNone;
  int worst = -1;
  for (int i = 0; i < model_.rows(); ++i) {
    const auto slot = std::ranges::lower_bound(term_slots.slots, keys_[static_cast<size_t>(i)], {}, &Slot::key);
    if (slot != term_slots.slots.end() && slot->key == keys_[static_cast<size_t>(i)]) {
      if (!varies || model_.value(i) > row_values_[slot->row]) Put(slot->row, i);
    } else if (worst < 0 || model_.value(i) > model_.value(worst)) {
      worst = i;
    }
  }
  if (worst >= 0 && varies && model_.value(worst) > row_values_[term_slots.shared]) Put(term_slots.shared, worst);
}

void SlottedProgram::Put(size_t row, int model_row) {
  row_values_[row] = model_.value(model_row);
  const int size = program_->tangent_size();
  for (int b = 0; b * size < rows_[row].size; ++b) {
    std::copy_n(model_.row(b, model_row), size, jacobian_.data() + rows_[row].begin + static_cast<size_t>(b * size));
  }
}

bool SlottedProgram::SharedSlotActive(double tolerance) const {
  return std::ranges::any_of(term_slots_, [&](const TermSlots& term) {
    return term.shared != kNone && row_values_[term.shared] > -tolerance;
  });
}

bool SlottedProgram::IsFinite() const {
  const auto finite = [](double v) { return std::isfinite(v); };
  return std::ranges::all_of(jacobian_, finite) && std::ranges::all_of(cost_->gradient(), finite);
}

}  // namespace legopt
