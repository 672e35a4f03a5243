#pragma once

#include <memory>
#include <mutex>
#include <string>

namespace Ipopt {
class TNLP;
}

namespace legopt {

/// Ipopt with MUMPS for one solve: silent, and deaf to option files in the working directory. MUMPS keeps global state,
/// so the constructor waits until no other one lives in this process.
class QuietIpopt {
 public:
  /// How a solve ended.
  enum class End {
    kSolved,          ///< to Ipopt's tolerance, or to its acceptable level
    kIterationLimit,  ///< `max_iter` was reached
    kStopped,         ///< by the program's callback
    kNoProgress,      ///< infeasible as far as Ipopt can see, or steps too small
    kFailed,          ///< anything else, e.g. numbers that are not finite
  };

  QuietIpopt();
  ~QuietIpopt();
  QuietIpopt(const QuietIpopt&) = delete;
  QuietIpopt& operator=(const QuietIpopt&) = delete;

  /// Sets an option, before Solve(). One whose name or value Ipopt refuses keeps its default, and Ipopt complains on
  /// standard output; the names used here are constants.
  void SetNumber(const std::string& option, double value);
  /// The same for options that are whole numbers.
  void SetInteger(const std::string& option, int value);
  /// The same for options that are words.
  void SetText(const std::string& option, const std::string& value);

  /// Once. `program` belongs to a SmartPtr; none of its functions may throw.
  End Solve(Ipopt::TNLP& program);
  int iterations() const;  ///< of Solve

 private:
  struct Application;

  std::lock_guard<std::mutex> lock_;
  std::unique_ptr<Application> application_;
};

}  // namespace legopt
