#include "legopt/solvers/subproblem/quiet_ipopt.h"

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>

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

}  // namespace legopt
