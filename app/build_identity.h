#pragma once

#include <string>

/// Identity of a build: facts about its origin, and a short id of those that may change the bits of a result. Thread
/// rule: none, values and pure functions.
namespace legopt::app {

/// Facts about a build. All texts are safe for messages and terminals.
struct BuildFacts {
  std::string version;       ///< release, "0.1.0"
  std::string commit;        ///< commit of the source tree from `git describe --always --dirty`; empty: no git tree
  std::string sources;       ///< hash of the sources of legopt-worker, 64 hex digits
  std::string compiler;      ///< "GNU 12.2.0"
  std::string flags;         ///< compiler flags that may change the bits of results
  std::string libraries;     ///< numerical libraries with the versions it was compiled against
  std::string math_library;  ///< C library of the running process, "glibc 2.36"
  std::string numerics;  ///< fingerprint of the process's numerical results; empty for programs that compute no results
};

/// Returns the facts of the running program; `numerics` as above. Defined in a separate target, legopt_this_build,
/// which each program links, because it changes with every commit and nothing else should be recompiled or relinked for
/// that.
BuildFacts ThisBuild(std::string numerics);

/// Returns 12 hex digits that are equal if and only if all facts except `commit` and `math_library` are equal. A commit
/// that changes only documents or the client therefore creates no new build, nor does a C library whose functions
/// return the same numbers.
std::string BuildId(const BuildFacts& build);

/// Returns one line of at most 200 bytes for listings: "legopt 0.1.0 (8a643da59c-dirty), GNU 12.2.0, numerics 1f...".
std::string BuildName(const BuildFacts& build);

/// Returns all facts for humans, one per line, beginning with the id; printed by `--version --verbose`. Without an id
/// if `numerics` is empty, because such a program is no worker.
std::string BuildReport(const BuildFacts& build);

}  // namespace legopt::app
