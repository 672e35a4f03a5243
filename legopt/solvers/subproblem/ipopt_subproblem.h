#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "legopt/solvers/subproblem/convex_subproblem.h"

namespace Ipopt {
class TNLP;
}

namespace legopt {

/// Ipopt with MUMPS for one solve, without output and without option files from the working directory. MUMPS has global
/// state, so the constructor waits until no other instance exists in this process.
class QuietIpopt {
 public:
  /// End of a solve.
  enum class End {
    kSolved,          ///< Ipopt's tolerance, or its acceptable level, is reached
    kIterationLimit,  ///< `max_iter` was reached
    kStopped,         ///< stopped by the program's callback
    kNoProgress,      ///< locally infeasible according to Ipopt, or steps too small
    kFailed,          ///< anything else, e.g. non-finite numbers
  };

  QuietIpopt();
  ~QuietIpopt();
  QuietIpopt(const QuietIpopt&) = delete;
  QuietIpopt& operator=(const QuietIpopt&) = delete;

  /// Sets a real-valued option before Solve(). If Ipopt rejects its name or value, the default stays and Ipopt prints
  /// an error to standard output; all names used here are constants.
  void SetNumber(const std::string& option, double value);
  /// Sets an integer option.
  void SetInteger(const std::string& option, int value);
  /// Sets a string option.
  void SetText(const std::string& option, const std::string& value);

  /// Solves `program`, once. It must belong to a SmartPtr; none of its functions may throw.
  End Solve(Ipopt::TNLP& program);
  int iterations() const;  ///< number of iterations of Solve

 private:
  struct Application;

  std::lock_guard<std::mutex> lock_;
  std::unique_ptr<Application> application_;
};

/// Solves ConvexSubproblem with Ipopt and MUMPS: an independent check of InteriorPointSolver, two orders of magnitude
/// slower. Every penalty becomes a slack s >= |a| or s >= max(0, a) with cost w s; the objective is divided by the
/// largest weight.
///
/// MUMPS allows one solve per process at a time: a lock serialises the solves of all instances.
class IpoptSubproblemSolver : public SubproblemSolver {
 public:
  Result Solve(const ConvexSubproblem& problem, const Accuracy& accuracy, Eigen::Ref<Eigen::VectorXd> dx) override;
};

}  // namespace legopt
