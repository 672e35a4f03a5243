#pragma once

#include <string>

/// The name of a build: what a program was made from, and one short id of all of it that may change a result's bits.
/// Thread rule: none, values and pure functions.
namespace legopt::programs {

/// All texts may stand in messages and on terminals.
struct BuildFacts {
  std::string version;       ///< release, "0.1.0"
  std::string commit;        ///< of the source tree, as `git describe --always --dirty` says; empty: no git tree
  std::string sources;       ///< hash of the sources of legopt-worker, 64 hex digits
  std::string compiler;      ///< "GNU 12.2.0"
  std::string flags;         ///< of the numerics, as far as they may change bits
  std::string libraries;     ///< numerical ones that it was compiled against, with their versions
  std::string math_library;  ///< the one that runs now, "glibc 2.36"
  std::string numerics;      ///< fingerprint of what the process computes; empty for programs that compute no results
};

/// Of the running program; `numerics` as above. In a target of its own, legopt_this_build, which each program links: it
/// changes with every commit, and nothing else shall be compiled or linked anew for that.
BuildFacts ThisBuild(std::string numerics);

/// 12 hex digits, the same exactly when all facts but `commit` and `math_library` are: a commit that changes documents
/// or the client does not make another build of what computes results, nor does a C library whose functions give the
/// same numbers.
std::string BuildId(const BuildFacts& build);

/// One line of at most 200 bytes for listings: "legopt 0.1.0 (8a643da59c-dirty), GNU 12.2.0, numerics 1f...".
std::string BuildName(const BuildFacts& build);

/// All facts for people, a line each, the id first; what `--version --verbose` prints. Without an id where numerics are
/// empty: it would be no worker's.
std::string BuildReport(const BuildFacts& build);

}  // namespace legopt::programs
