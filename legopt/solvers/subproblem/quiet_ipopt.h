#pragma once

#include <memory>
#include <mutex>
#include <string>

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

}  // namespace legopt
