#include "worker/external/solver_confinement.h"

#include <linux/capability.h>
#include <sys/prctl.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "bus/network_namespace.h"

extern char** environ;

namespace legopt::external {
namespace {

constexpr std::string_view kOurs = "LEGOPT_";
constexpr std::array<std::string_view, 18> kPassedOn = {"PATH",
                                                        "HOME",
                                                        "USER",
                                                        "LOGNAME",
                                                        "SHELL",
                                                        "LANG",
                                                        "TZ",
                                                        "LANGUAGE",
                                                        "TMPDIR",
                                                        "TERM",
                                                        "PYTHONPATH",
                                                        "PYTHONHOME",
                                                        "PYTHONDONTWRITEBYTECODE",
                                                        "VIRTUAL_ENV",
                                                        "CONDA_PREFIX",
                                                        "LD_LIBRARY_PATH",
                                                        "OMP_NUM_THREADS",
                                                        "OPENBLAS_NUM_THREADS"};
constexpr std::string_view kLocalePrefix = "LC_";

bool IsPassedOn(std::string_view name, std::span<const std::string> further) {
  if (name.starts_with(kOurs)) return false;
  return name.starts_with(kLocalePrefix) || std::ranges::find(kPassedOn, name) != kPassedOn.end() ||
         std::ranges::find(further, name) != further.end();
}

// Solvers of a worker that runs as root keep root's rights to files, because files may belong to any user.
constexpr std::array<int, 5> kFileCapabilities = {CAP_CHOWN, CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH, CAP_FOWNER,
                                                  CAP_FSETID};

void DropCapabilities() {
  for (int capability = 0; capability <= CAP_LAST_CAP; ++capability) {
    if (std::ranges::find(kFileCapabilities, capability) != kFileCapabilities.end()) continue;
    ::prctl(PR_CAPBSET_DROP, capability, 0, 0, 0);
  }
}

}  // namespace

std::vector<std::string> SolverEnvironment(std::span<const std::string> further) {
  std::vector<std::string> variables;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    if (IsPassedOn(text.substr(0, text.find('=')), further)) variables.emplace_back(text);
  }
  return variables;
}

bool MayPassOn(const std::string& name) {
  return !name.starts_with(kOurs) && name.find('=') == std::string::npos && !name.empty();
}

void ConfineSolver(bool needs_network) {
  if (!needs_network) {
    ::prctl(PR_SET_DUMPABLE, 1, 0, 0, 0);  // needed to write the map of users through /proc; exec also sets it
    if (bus::EnterNetworkNamespace().empty()) bus::RaiseLoopback();
  }
  DropCapabilities();
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
}

void HideFromOtherProcesses() { ::prctl(PR_SET_DUMPABLE, 0, 0, 0, 0); }

}  // namespace legopt::external
