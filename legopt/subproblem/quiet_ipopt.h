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
  enum class End {
    kSolved,
    kIterationLimit,
    kStopped,     ///< by the program's callback
    kNoProgress,  ///< infeasible as far as Ipopt can see, or steps too small
    kFailed,      ///< anything else; also an option that Ipopt refuses
  };

  QuietIpopt();
  ~QuietIpopt();
  QuietIpopt(const QuietIpopt&) = delete;
  QuietIpopt& operator=(const QuietIpopt&) = delete;

  void SetNumber(const std::string& option, double value);
  void SetInteger(const std::string& option, int value);
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
