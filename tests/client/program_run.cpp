#include "program_run.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "tests/folders.h"

namespace legopt::client {
namespace {

void SetEnvironment(const std::map<std::string, std::string>& environment) {
  for (const auto& [name, value] : environment) {
    if (value.empty()) {
      ::unsetenv(name.c_str());
    } else {
      ::setenv(name.c_str(), value.c_str(), 1);
    }
  }
}

bool Drain(int* fd, std::string* text) {
  std::array<char, 4096> buffer{};
  const ssize_t count = ::read(*fd, buffer.data(), buffer.size());
  if (count > 0) {
    text->append(buffer.data(), static_cast<std::size_t>(count));
    return true;
  }
  ::close(*fd);
  *fd = -1;
  return false;
}

}  // namespace

std::filesystem::path BuiltProgram(const std::string& name) { return std::filesystem::path(BuildFolder()) / name; }

std::vector<int> ChildrenOf(int parent, const std::string& name) {
  std::vector<int> children;
  std::ifstream list("/proc/" + std::to_string(parent) + "/task/" + std::to_string(parent) + "/children");
  for (int pid = 0; list >> pid;) {
    std::error_code error;
    const auto program = std::filesystem::read_symlink("/proc/" + std::to_string(pid) + "/exe", error);
    if (!error && program.filename() == name) children.push_back(pid);
  }
  return children;
}

std::vector<int> WaitForChildren(int parent, const std::string& name) {
  constexpr int kLooks = 6000;
  constexpr std::chrono::milliseconds kBetweenLooks(10);
  std::vector<int> children;
  for (int look = 0; look < kLooks && children.empty(); ++look) {
    children = ChildrenOf(parent, name);
    if (children.empty()) std::this_thread::sleep_for(kBetweenLooks);
  }
  return children;
}

void WaitForEnd(int pid) {
  const int descriptor = static_cast<int>(::syscall(SYS_pidfd_open, pid, 0));
  if (descriptor < 0) return;  // has ended already
  pollfd ended{descriptor, POLLIN, 0};
  while (::poll(&ended, 1, -1) < 0) {
  }
  ::close(descriptor);
}

RunningProgram::RunningProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                               const std::filesystem::path& folder,
                               const std::map<std::string, std::string>& environment) {
  std::array<int, 2> out{}, err{};
  if (::pipe2(out.data(), O_CLOEXEC) != 0 || ::pipe2(err.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  std::vector<std::string> texts = {program.string()};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (auto& text : texts) argv.push_back(text.data());
  argv.push_back(nullptr);
  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::signal(SIGINT, SIG_DFL);  // ignored if a script runs the tests in the background
    SetEnvironment(environment);
    if (::chdir(folder.c_str()) != 0) ::_exit(99);
    ::dup2(out[1], STDOUT_FILENO);
    ::dup2(err[1], STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(99);
  }
  ::close(out[1]);
  ::close(err[1]);
  out_fd_ = out[0];
  err_fd_ = err[0];
}

RunningProgram::~RunningProgram() {
  if (reaped_) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
  if (out_fd_ >= 0) ::close(out_fd_);
  if (err_fd_ >= 0) ::close(err_fd_);
}

bool RunningProgram::ReadMore() {
  if (out_fd_ < 0 && err_fd_ < 0) return false;
  std::array<pollfd, 2> fds = {{{out_fd_, POLLIN, 0}, {err_fd_, POLLIN, 0}}};
  if (::poll(fds.data(), fds.size(), -1) < 0) return true;
  if (fds[0].revents != 0) Drain(&out_fd_, &result_.out);
  if (fds[1].revents != 0) Drain(&err_fd_, &result_.err);
  return true;
}

bool RunningProgram::WaitForError(const std::string& word) {
  while (result_.err.find(word) == std::string::npos) {
    if (!ReadMore()) return false;
  }
  return true;
}

bool RunningProgram::WaitForOutput(const std::function<bool(const std::string&)>& enough) {
  while (!enough(result_.out)) {
    if (!ReadMore()) return false;
  }
  return true;
}

ProgramResult RunningProgram::Wait() {
  while (ReadMore()) {
  }
  int status = 0;
  ::waitpid(pid_, &status, 0);
  reaped_ = true;
  result_.exit_code = WIFSIGNALED(status) ? kSignalBase + WTERMSIG(status) : WEXITSTATUS(status);
  return result_;
}

ProgramResult RunLegopt(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                        const std::map<std::string, std::string>& environment) {
  return RunningProgram(BuiltProgram("legopt"), arguments, folder, environment).Wait();
}

}  // namespace legopt::client
