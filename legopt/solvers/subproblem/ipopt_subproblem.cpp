#include "legopt/solvers/subproblem/ipopt_subproblem.h"

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <vector>

namespace legopt {
namespace {

std::mutex& MumpsMutex() {
  static std::mutex mutex;
  return mutex;
}

QuietIpopt::End EndOf(Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
    case Ipopt::Solved_To_Acceptable_Level:
      return QuietIpopt::End::kSolved;
    case Ipopt::Maximum_Iterations_Exceeded:
      return QuietIpopt::End::kIterationLimit;
    case Ipopt::User_Requested_Stop:
      return QuietIpopt::End::kStopped;
    case Ipopt::Infeasible_Problem_Detected:
    case Ipopt::Restoration_Failed:
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return QuietIpopt::End::kNoProgress;
    default:
      return QuietIpopt::End::kFailed;
  }
}

}  // namespace

struct QuietIpopt::Application {
  Ipopt::SmartPtr<Ipopt::IpoptApplication> ipopt = IpoptApplicationFactory();
};

QuietIpopt::QuietIpopt() : lock_(MumpsMutex()), application_(std::make_unique<Application>()) {
  SetInteger("print_level", 0);
  SetText("sb", "yes");
}

QuietIpopt::~QuietIpopt() = default;

void QuietIpopt::SetNumber(const std::string& option, double value) {
  application_->ipopt->Options()->SetNumericValue(option, value);
}

void QuietIpopt::SetInteger(const std::string& option, int value) {
  application_->ipopt->Options()->SetIntegerValue(option, value);
}

void QuietIpopt::SetText(const std::string& option, const std::string& value) {
  application_->ipopt->Options()->SetStringValue(option, value);
}

QuietIpopt::End QuietIpopt::Solve(Ipopt::TNLP& program) {
  Ipopt::IpoptApplication& ipopt = *application_->ipopt;
  if (ipopt.Initialize("") != Ipopt::Solve_Succeeded) return End::kFailed;  // the empty name disables option files
  return EndOf(ipopt.OptimizeTNLP(&program));
}

int QuietIpopt::iterations() const {
  const auto statistics = application_->ipopt->Statistics();
  return Ipopt::IsValid(statistics) ? statistics->IterationCount() : 0;
}

namespace {

using Ipopt::Index;
using Ipopt::Number;

constexpr double kIpoptInfinity = 2e19;  // beyond Ipopt's threshold for "no bound"
constexpr double kMinTolerance = 1e-11;
constexpr int kIpoptMaxIterations = 300;

/// Program with the variables dx (unpadded) and one slack s per row. Constraints: a x + b - s <= 0, and for absolute
/// rows also -a x - b - s <= 0.
class SlackProgram : public Ipopt::TNLP {
 public:
  SlackProgram(const ConvexSubproblem& problem, Eigen::Ref<Eigen::VectorXd> solution)
      : problem_(problem),
        solution_(solution),
        n_(problem.num_blocks() * problem.block_size()),
        scale_(problem.max_weight() > 0.0 ? problem.max_weight() : 1.0) {
    for (size_t i = 0; i < problem.rows().size(); ++i) {
      constraints_.push_back({i, 1.0});
      if (problem.rows()[i].absolute) constraints_.push_back({i, -1.0});
    }
  }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hessian, IndexStyleEnum& style) override {
    n = n_ + static_cast<Index>(problem_.rows().size());
    m = static_cast<Index>(constraints_.size());
    nnz_jac = 0;
    for (const Constraint& c : constraints_) nnz_jac += Entries(problem_.rows()[c.row]) + 1;
    nnz_hessian = 0;
    ForEachEntry([&nnz_hessian](int, int, double) { ++nnz_hessian; });
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l, Number* g_u) override {
    for (Index i = 0; i < n_; ++i) {
      x_l[i] = problem_.lower()[Padded(i)];
      x_u[i] = problem_.upper()[Padded(i)];
    }
    std::fill(x_l + n_, x_l + n, 0.0);
    std::fill(x_u + n_, x_u + n, kIpoptInfinity);
    std::fill(g_l, g_l + m, -kIpoptInfinity);
    std::fill(g_u, g_u + m, 0.0);
    return true;
  }

  bool get_starting_point(Index n, bool, Number* x, bool, Number*, Number*, Index, bool, Number*) override {
    for (Index i = 0; i < n_; ++i) x[i] = std::clamp(0.0, problem_.lower()[Padded(i)], problem_.upper()[Padded(i)]);
    for (Index i = n_; i < n; ++i) {
      x[i] = 1.0 + std::abs(RowValue(problem_.rows()[static_cast<size_t>(i - n_)], x));
    }
    return true;
  }

  bool eval_f(Index n, const Number* x, bool, Number& value) override {
    value = problem_.constant();
    for (Index i = 0; i < n_; ++i) value += problem_.gradient()[Padded(i)] * x[i];
    ForEachEntry([&value, x](int i, int j, double h) { value += (i == j ? 0.5 : 1.0) * h * x[i] * x[j]; });
    for (Index i = n_; i < n; ++i) value += problem_.rows()[static_cast<size_t>(i - n_)].weight * x[i];
    value /= scale_;
    return true;
  }

  bool eval_grad_f(Index n, const Number* x, bool, Number* gradient) override {
    for (Index i = 0; i < n_; ++i) gradient[i] = problem_.gradient()[Padded(i)] / scale_;
    ForEachEntry([this, gradient, x](int i, int j, double h) {
      gradient[i] += h * x[j] / scale_;
      if (i != j) gradient[j] += h * x[i] / scale_;
    });
    for (Index i = n_; i < n; ++i) gradient[i] = problem_.rows()[static_cast<size_t>(i - n_)].weight / scale_;
    return true;
  }

  bool eval_g(Index, const Number* x, bool, Index m, Number* g) override {
    for (Index c = 0; c < m; ++c) {
      const Constraint& constraint = constraints_[static_cast<size_t>(c)];
      g[c] =
          constraint.sign * RowValue(problem_.rows()[constraint.row], x) - x[n_ + static_cast<Index>(constraint.row)];
    }
    return true;
  }

  bool eval_jac_g(Index, const Number*, bool, Index m, Index, Index* rows, Index* columns, Number* values) override {
    Index k = 0;
    for (Index c = 0; c < m; ++c) {
      const Constraint& constraint = constraints_[static_cast<size_t>(c)];
      const ConvexSubproblem::Row& row = problem_.rows()[constraint.row];
      for (int e = 0; e < Entries(row); ++e, ++k) {
        const int block = e / problem_.block_size();
        const int i = e % problem_.block_size();
        if (values != nullptr) {
          values[k] = constraint.sign * problem_.coefficients(row, block)[i];
        } else {
          rows[k] = c;
          columns[k] = row.block * problem_.block_size() + e;
        }
      }
      if (values != nullptr) {
        values[k++] = -1.0;
      } else {
        rows[k] = c;
        columns[k++] = n_ + static_cast<Index>(constraint.row);
      }
    }
    return true;
  }

  bool eval_h(Index, const Number*, bool, Number factor, Index, const Number*, bool, Index, Index* rows, Index* columns,
              Number* values) override {
    Index k = 0;
    ForEachEntry([&](int i, int j, double h) {
      if (values != nullptr) {
        values[k++] = factor * h / scale_;
      } else {
        rows[k] = j;  // lower triangle
        columns[k++] = i;
      }
    });
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn, Index, const Number* x, const Number*, const Number*, Index,
                         const Number*, const Number*, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    for (Index i = 0; i < n_; ++i) {
      solution_[i] = std::clamp(x[i], problem_.lower()[Padded(i)], problem_.upper()[Padded(i)]);
    }
  }

 private:
  struct Constraint {
    size_t row;
    double sign;
  };

  size_t Padded(Index i) const {
    return static_cast<size_t>(i / problem_.block_size() * problem_.stride() + i % problem_.block_size());
  }
  int Entries(const ConvexSubproblem::Row& row) const { return row.num_blocks * problem_.block_size(); }

  double RowValue(const ConvexSubproblem::Row& row, const Number* x) const {
    double sum = row.offset;
    for (int k = 0; k < row.num_blocks; ++k) {
      const double* a = problem_.coefficients(row, k);
      const Number* block = x + static_cast<std::ptrdiff_t>(row.block + k) * problem_.block_size();
      for (int i = 0; i < problem_.block_size(); ++i) sum += a[i] * block[i];
    }
    return sum;
  }

  template <class Visit>
  void ForEachEntry(Visit visit) const {
    ForEachHessianEntry(problem_, problem_.has_coupling(), visit);
  }

  const ConvexSubproblem& problem_;
  Eigen::Ref<Eigen::VectorXd> solution_;
  Index n_;
  double scale_;
  std::vector<Constraint> constraints_;
};

}  // namespace

SubproblemSolver::Result IpoptSubproblemSolver::Solve(const ConvexSubproblem& problem, const Accuracy& accuracy,
                                                      Eigen::Ref<Eigen::VectorXd> dx) {
  const double scale = problem.max_weight() > 0.0 ? problem.max_weight() : 1.0;
  QuietIpopt ipopt;
  ipopt.SetNumber("tol", std::max(accuracy.gap / scale, kMinTolerance));
  ipopt.SetInteger("max_iter", kIpoptMaxIterations);
  ipopt.SetText("mehrotra_algorithm", "yes");
  ipopt.SetText("hessian_constant", "yes");
  ipopt.SetText("jac_c_constant", "yes");
  ipopt.SetText("jac_d_constant", "yes");
  const Ipopt::SmartPtr<SlackProgram> program = new SlackProgram(problem, dx);
  const QuietIpopt::End end = ipopt.Solve(*program);
  Result result;
  if (end == QuietIpopt::End::kSolved) result.status = Status::kSolved;
  if (end == QuietIpopt::End::kIterationLimit) result.status = Status::kIterationLimit;
  result.iterations = ipopt.iterations();
  result.gap = accuracy.gap;
  return result;
}

}  // namespace legopt
