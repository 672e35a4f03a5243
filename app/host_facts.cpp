#include "app/host_facts.h"

#include <fstream>
#include <string_view>

#include "legopt/types/classic_stream.h"

namespace legopt::app {
namespace {

// Returns the value of the first line "name<tabs>: value" with this name; empty if there is none.
std::string ValueOf(const std::filesystem::path& file, std::string_view name) {
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    if (line.compare(0, name.size(), name) != 0) continue;
    const std::size_t value = line.find_first_not_of(" \t", line.find(':') + 1);
    if (line.find(':') != std::string::npos && value != std::string::npos) return line.substr(value);
  }
  return {};
}

}  // namespace

HostFacts ReadHostFacts(const std::filesystem::path& root) {
  constexpr std::int64_t kKibibyte = 1024;
  HostFacts facts;
  facts.processor = ValueOf(root / "proc/cpuinfo", "model name");
  if (facts.processor.empty()) facts.processor = "unknown";
  std::int64_t kibibytes = 0;
  ClassicInput(ValueOf(root / "proc/meminfo", "MemTotal")) >> kibibytes;
  facts.memory_bytes = kibibytes * kKibibyte;
  return facts;
}

double HostLoad(const std::filesystem::path& root) {
  double load = 0;
  std::ifstream file(root / "proc/loadavg");
  return file >> load && load >= 0 ? load : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace legopt::app
