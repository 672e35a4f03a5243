#include "app/build_identity.h"

#include <cstddef>
#include <string_view>

#include "legopt/math/blake2b.h"

namespace legopt::app {

std::string BuildId(const BuildFacts& build) {
  constexpr std::size_t kDigits = 12;
  std::string all;
  for (const std::string* fact :
       {&build.version, &build.sources, &build.compiler, &build.flags, &build.libraries, &build.numerics}) {
    all += *fact + '\n';
  }
  return Blake2bHex(all).substr(0, kDigits);
}

std::string BuildName(const BuildFacts& build) {
  constexpr std::size_t kMostBytes = 200;
  const std::string commit = build.commit.empty() ? "" : " (" + build.commit + ")";
  const std::string numerics = build.numerics.empty() ? "" : ", numerics " + build.numerics;
  return ("legopt " + build.version + commit + ", " + build.compiler + numerics).substr(0, kMostBytes);
}

std::string BuildReport(const BuildFacts& build) {
  constexpr std::size_t kSourceDigits = 12;
  std::string report;
  const auto add = [&report](std::string_view name, const std::string& text) {
    constexpr std::size_t kColumn = 11;
    if (!report.empty()) report += '\n';
    report.append(name).append(kColumn - name.size(), ' ').append(text);
  };
  if (!build.numerics.empty()) add("build", BuildId(build));
  add("version", build.version);
  add("commit", build.commit.empty() ? "unknown: not built from a git tree" : build.commit);
  add("sources", build.sources.substr(0, kSourceDigits));
  add("compiler", build.compiler);
  add("flags", build.flags);
  add("libraries", build.libraries);
  add("math", build.math_library);
  add("numerics", build.numerics.empty() ? "computes no results" : build.numerics);
  return report;
}

}  // namespace legopt::app
