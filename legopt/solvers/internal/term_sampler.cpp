#include "legopt/solvers/internal/term_sampler.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "legopt/types/invariant.h"

namespace legopt {

void ShiftModels(const Program& program, const Eigen::VectorXd& dx, TermModels& models) {
  const auto& terms = program.terms();
  const int size = program.tangent_size();
  for (size_t k = 0; k < terms.size(); ++k) {
    models[k].Shift(dx.data() + static_cast<Eigen::Index>(terms[k]->shape().waypoint) * size, size);
  }
}

void TermSampler::Reset(const Program& program, const Sampling& sampling) {
  units_.clear();
  std::map<int, size_t> known;
  const auto& terms = program.terms();
  CheckInvariant(!terms.empty(), "a program to be solved has a term");
  for (size_t i = 0; i < terms.size(); ++i) {
    const int unit = terms[i]->shape().unit;
    size_t place = units_.size();
    if (unit >= 0) place = known.try_emplace(unit, place).first->second;
    if (place == units_.size()) units_.emplace_back();
    units_[place].push_back(static_cast<int>(i));
  }
  constexpr double kPercent = 100.0;
  const double share = static_cast<double>(sampling.percent) / kPercent * static_cast<double>(units_.size());
  batch_size_ = std::clamp(static_cast<int>(std::lround(share)), 1, std::max(1, num_units()));
  order_.resize(units_.size());
  std::iota(order_.begin(), order_.end(), 0);
  chosen_.assign(terms.size(), 0);
  Restart();
}

void TermSampler::Shuffle(std::mt19937_64& generator, int first, int count) {
  // Fisher-Yates shuffle. The modulo's bias is below 1e-17 for any number of terms.
  for (int i = first; i < first + count; ++i) {
    const auto left = static_cast<std::uint64_t>(num_units() - i);
    std::swap(order_[static_cast<size_t>(i)], order_[static_cast<size_t>(i) + generator() % left]);
  }
}

void TermSampler::Mark(int begin, int end) {
  std::fill(chosen_.begin(), chosen_.end(), std::uint8_t{0});
  for (int i = begin; i < end; ++i) {
    for (const int term : units_[static_cast<size_t>(order_[static_cast<size_t>(i)])]) {
      chosen_[static_cast<size_t>(term)] = 1;
    }
  }
}

const std::vector<std::uint8_t>& TermSampler::Draw(std::mt19937_64& generator) {
  Shuffle(generator, 0, batch_size_);
  Mark(0, batch_size_);
  return chosen_;
}

const std::vector<std::uint8_t>& TermSampler::NextBatch(std::mt19937_64& generator) {
  const int left = num_units() - next_;
  if (left < batch_size_) {
    std::rotate(order_.begin(), order_.begin() + next_, order_.end());
    if (!everything()) Shuffle(generator, left, num_units() - left);
    next_ = 0;
  }
  Mark(next_, next_ + batch_size_);
  next_ += batch_size_;
  return chosen_;
}

const std::vector<std::uint8_t>& TermSampler::All() {
  std::fill(chosen_.begin(), chosen_.end(), std::uint8_t{1});
  return chosen_;
}

}  // namespace legopt
