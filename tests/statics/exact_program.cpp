#include "tests/statics/exact_program.h"

#include <gmp.h>

extern "C" {
#include <qsopt_ex/QSopt_ex.h>
}

#include <cmath>
#include <vector>

namespace legopt::test {
namespace {

/// An array of rationals.
class Rationals {
 public:
  explicit Rationals(size_t size) : values_(size) {
    for (auto& value : values_) mpq_init(value.number);
  }
  ~Rationals() {
    for (auto& value : values_) mpq_clear(value.number);
  }
  Rationals(const Rationals&) = delete;
  Rationals& operator=(const Rationals&) = delete;

  void Set(size_t index, double value) { mpq_set_d(values_[index].number, value); }
  mpq_t* data() { return &values_.front().number; }

 private:
  struct Value {
    mpq_t number;
  };
  std::vector<Value> values_;
};

/// QSopt_ex has one global state.
struct Library {
  Library() { QSexactStart(); }
  ~Library() { QSexactClear(); }
};

}  // namespace

std::optional<double> MinimumByExactSimplex(const ReferenceProgram& program) {
  static const Library library;
  const auto rows = static_cast<size_t>(program.A.rows()), columns = static_cast<size_t>(program.A.cols());
  mpq_QSdata* problem = mpq_QScreate_prob("stance", QS_MIN);
  Rationals number(3);
  mpq_t* values = number.data();
  number.Set(1, 0.0);
  for (size_t j = 0; j < columns; ++j) {
    number.Set(0, program.c[static_cast<Eigen::Index>(j)]);
    mpq_QSnew_col(problem, values[0], values[1], mpq_ILL_MAXDOUBLE, nullptr);
  }
  for (size_t i = 0; i < rows; ++i) {
    std::vector<int> indices;
    std::vector<double> entries;
    for (size_t j = 0; j < columns; ++j) {
      const double entry = program.A(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      if (entry == 0.0) continue;
      indices.push_back(static_cast<int>(j));
      entries.push_back(entry);
    }
    Rationals exact(entries.size() + 1);
    for (size_t k = 0; k < entries.size(); ++k) exact.Set(k, entries[k]);
    number.Set(0, program.upper[static_cast<Eigen::Index>(i)]);  // these programs have no other bounds
    mpq_QSadd_row(problem, static_cast<int>(indices.size()), indices.data(), exact.data(), &values[0], 'L', nullptr);
  }
  int status = 0;
  std::optional<double> minimum;
  // Every pivot in rational arithmetic: the combined solver, which begins in floating point, returns wrong values for
  // some of these programs.
  if (mpq_QSopt_primal(problem, &status) == 0 && status == QS_LP_OPTIMAL) {
    mpq_QSget_objval(problem, &values[2]);
    minimum = mpq_get_d(values[2]);
  }
  mpq_QSfree_prob(problem);
  return minimum;
}

}  // namespace legopt::test
