#include "app/notifier.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "app/processes.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

extern char** environ;

namespace legopt::app {
namespace {

constexpr std::size_t kMostBytes = 4096;  // size that a pipe accepts without blocking

std::vector<std::string> WordsOfCommand(const std::string& command) {
  if (IsExecutable(command)) return {std::filesystem::absolute(command).string()};
  std::vector<std::string> words;
  ClassicInput stream(command);
  for (std::string word; stream >> word;) words.push_back(word);
  if (words.empty()) return words;
  const std::filesystem::path program = words.front().find('/') == std::string::npos
                                            ? FindProgram(words.front())
                                            : std::filesystem::absolute(words.front());
  words.front() = IsExecutable(program) ? program.string() : std::string();
  return words;
}

// Set-up of the child process: the text as its input, no output, default actions for all signals.
class SpawnPlan {
 public:
  explicit SpawnPlan(int input) {
    ::posix_spawn_file_actions_init(&actions_);
    ::posix_spawn_file_actions_adddup2(&actions_, input, STDIN_FILENO);
    ::posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    ::posix_spawnattr_init(&attributes_);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    ::posix_spawnattr_setsigmask(&attributes_, &none);
    ::posix_spawnattr_setsigdefault(&attributes_, &all);
    ::posix_spawnattr_setpgroup(&attributes_, 0);
    ::posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  }
  ~SpawnPlan() {
    ::posix_spawn_file_actions_destroy(&actions_);
    ::posix_spawnattr_destroy(&attributes_);
  }
  SpawnPlan(const SpawnPlan&) = delete;
  SpawnPlan& operator=(const SpawnPlan&) = delete;

  int Start(pid_t* pid, std::vector<std::string>& words) const {
    const std::vector<char*> arguments = Pointers(words);
    return ::posix_spawn(pid, words.front().c_str(), &actions_, &attributes_, arguments.data(), environ);
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

}  // namespace

Notifier::Notifier(const std::string& command, NotifierLimits limits)
    : command_(WordsOfCommand(command)), limits_(limits) {
  if (command_.empty() || command_.front().empty()) {
    throw InputError({"--notify", "", command, "there is no such program",
                      "give an executable file, or a program of PATH, and its arguments; no shell reads them"});
  }
}

Notifier::~Notifier() {
  if (pid_ < 0) return;
  ::kill(-pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

void Notifier::Add(std::string text) {
  if (waiting_.size() >= limits_.most_waiting) {
    ++dropped_;
    return;
  }
  text.resize(std::min(text.size(), kMostBytes));
  waiting_.push_back(std::move(text));
}

std::string Notifier::Work(Clock::time_point now) {
  std::string fault = Reap(now);
  const bool may_start = !started_before_ || now - started_ >= limits_.pause;
  if (pid_ < 0 && may_start && !waiting_.empty()) fault += Start(now);
  if (dropped_ > dropped_reported_) {
    fault += "--notify: " + std::to_string(dropped_ - dropped_reported_) + " events dropped, too many wait";
    dropped_reported_ = dropped_;
  }
  return fault;
}

std::string Notifier::Start(Clock::time_point now) {
  const std::string text = std::move(waiting_.front());
  waiting_.pop_front();
  started_ = now;
  started_before_ = true;
  const std::optional<Pipe> pipe = MakePipe();
  if (!pipe) return std::string("--notify: no pipe: ") + std::strerror(errno);
  const SpawnPlan plan(pipe->read.get());
  if (const int error = plan.Start(&pid_, command_); error != 0) {
    pid_ = -1;
    return "--notify: " + command_.front() + " cannot be started: " + std::strerror(error);
  }
  // The text fits in an empty pipe. Programs with StopSignals ignore SIGPIPE.
  const ssize_t written = ::write(pipe->write.get(), text.data(), text.size());
  return written < 0 ? std::string("--notify: cannot write to the command: ") + std::strerror(errno) : std::string();
}

std::string Notifier::Reap(Clock::time_point now) {
  if (pid_ < 0) return {};
  int status = 0;
  const pid_t ended = ::waitpid(pid_, &status, WNOHANG);
  if (ended == 0 && now - started_ < limits_.longest) return {};
  std::string fault;
  if (ended == 0) {
    ::kill(-pid_, SIGKILL);
    ::waitpid(pid_, &status, 0);
    fault = "--notify: " + command_.front() + " was killed after " +
            std::to_string(std::chrono::duration_cast<std::chrono::seconds>(limits_.longest).count()) + " s";
  } else if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    fault = "--notify: " + command_.front() +
            (WIFEXITED(status) ? " ended with " + ExitCodeMeaning(WEXITSTATUS(status))
                               : " was ended by " + SignalMeaning(WTERMSIG(status)));
  }
  pid_ = -1;
  return fault;
}

}  // namespace legopt::app
