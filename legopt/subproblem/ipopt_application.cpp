#include "legopt/subproblem/ipopt_application.h"

namespace legopt {

std::mutex& IpoptMutex() {
  static std::mutex mutex;
  return mutex;
}

Ipopt::SmartPtr<Ipopt::IpoptApplication> MakeQuietIpopt() {
  Ipopt::SmartPtr<Ipopt::IpoptApplication> application = IpoptApplicationFactory();
  application->Options()->SetIntegerValue("print_level", 0);
  application->Options()->SetStringValue("sb", "yes");
  return application;
}

bool InitializeQuietly(Ipopt::IpoptApplication& application) {
  return application.Initialize("") == Ipopt::Solve_Succeeded;  // the empty name: no option file
}

}  // namespace legopt
