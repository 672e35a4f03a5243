#include "programs/build_identity.h"

#include <cstddef>

#include "legopt/blake2b.h"

namespace legopt::programs {

std::string BuildId(const BuildFacts& build) {
  constexpr std::size_t kDigits = 12;
  std::string all;
  for (const std::string* fact :
       {&build.version, &build.sources, &build.compiler, &build.flags, &build.libraries, &build.math_library}) {
    all += *fact + '\n';
  }
  return Blake2bHex(all).substr(0, kDigits);
}

std::string BuildName(const BuildFacts& build) {
  constexpr std::size_t kMostBytes = 200;
  const std::string commit = build.commit.empty() ? "" : " (" + build.commit + ")";
  return ("legopt " + build.version + commit + ", " + build.compiler).substr(0, kMostBytes);
}

std::string BuildReport(const BuildFacts& build) {
  constexpr std::size_t kSourceDigits = 12;
  return "build      " + BuildId(build) + "\nversion    " + build.version + "\ncommit     " +
         (build.commit.empty() ? "unknown: not built from a git tree" : build.commit) + "\nsources    " +
         build.sources.substr(0, kSourceDigits) + "\ncompiler   " + build.compiler + "\nflags      " + build.flags +
         "\nlibraries  " + build.libraries + "\nmath       " + build.math_library;
}

}  // namespace legopt::programs
