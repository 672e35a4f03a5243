#include "tests/figures/process_facts.h"

#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

namespace legopt::figures {
namespace {

std::filesystem::path Folder(pid_t pid) { return std::filesystem::path("/proc") / std::to_string(pid); }

// Fields 14 and 15 of /proc/PID/stat. The second field is a name that may contain spaces, so counting begins after it.
double CpuSeconds(pid_t pid) {
  constexpr int kWordsBefore = 11;
  std::ifstream file(Folder(pid) / "stat");
  std::string line;
  std::getline(file, line);
  const std::size_t name_end = line.rfind(')');
  if (name_end == std::string::npos) return 0;
  std::istringstream words(line.substr(name_end + 1));
  std::string skipped;
  for (int i = 0; i < kWordsBefore; ++i) words >> skipped;
  double user = 0, system = 0;
  words >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

}  // namespace

ProcessFacts FactsOf(pid_t pid) {
  ProcessFacts facts;
  std::ifstream status(Folder(pid) / "status");
  for (std::string word; status >> word;) {
    constexpr double kKibibytesPerMebibyte = 1024;
    double number = 0;
    if (word == "VmRSS:" && status >> number) facts.resident_mb = number / kKibibytesPerMebibyte;
    if (word == "Threads:" && status >> number) facts.threads = static_cast<int>(number);
  }
  facts.cpu_s = CpuSeconds(pid);
  std::error_code gone;
  const std::filesystem::directory_iterator descriptors(Folder(pid) / "fd", gone);
  if (!gone) facts.descriptors = static_cast<int>(std::distance(begin(descriptors), end(descriptors)));
  return facts;
}

std::vector<pid_t> ChildrenOf(pid_t pid) {
  std::vector<pid_t> children;
  std::ifstream list(Folder(pid) / "task" / std::to_string(pid) / "children");
  for (pid_t child = 0; list >> child;) children.push_back(child);
  return children;
}

EndOf::EndOf(pid_t pid) : fd_(static_cast<int>(syscall(SYS_pidfd_open, pid, 0))) {}

EndOf::~EndOf() {
  if (fd_ >= 0) ::close(fd_);
}

bool EndOf::reached() const {
  pollfd descriptor{fd_, POLLIN, 0};
  return fd_ < 0 || ::poll(&descriptor, 1, 0) == 1;
}

}  // namespace legopt::figures
