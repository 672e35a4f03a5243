#include "client/pool/pool_script.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>

#include "app/shell_word.h"
#include "client/client_error.h"
#include "client/pool/script_quoting.h"
#include "client/pool/worker_command.h"

namespace legopt::client {
namespace {

using app::ShellWord;

// Slurm checks time limits twice a minute and documents that --signal may come a minute early.
constexpr int kSlurmEarly_s = 60;

// File descriptors of the script through which the worker reads the embedded files.
constexpr std::string_view kAccessDescriptor = "3", kKeyDescriptor = "4";

// Opens the embedded texts as unlinked temporary files before the worker starts: a key must be in a file.
std::string OpenInlineFiles(const PoolAccess& access) {
  std::string lines;
  const auto open = [&lines](std::string_view descriptor, const std::string& text) {
    lines += "file=$(mktemp) || exit\ncat >\"$file\" <<'END'\n" + text;
    lines += (text.empty() || text.back() != '\n' ? "\n" : "");
    lines += "END\nexec " + std::string(descriptor) + "<\"$file\"\nrm -f \"$file\"\n";
  };
  if (access.access_file.empty()) open(kAccessDescriptor, access.access);
  if (access.key_file.empty() && !access.key.empty()) open(kKeyDescriptor, access.key);
  return lines.empty() ? lines : "umask 077\n" + lines;
}

// The user's options come last: sbatch uses the last one.
class SlurmOptions {
 public:
  explicit SlurmOptions(const PoolFile& pool) : pool_(pool) {}

  void Flag(const std::string& key) { Add(key, "--" + key); }
  void Set(const std::string& key, const std::string& value) { Add(key, "--" + key + "=" + SlurmWord(value)); }
  std::string text() const {
    std::string lines = text_;
    for (const EngineOption& option : pool_.options) {
      const std::string dashes = option.key.size() == 1 ? "-" : "--";
      const std::string separator = option.key.size() == 1 ? " " : "=";
      lines += "#SBATCH " + dashes + option.key + (option.value ? separator + SlurmWord(*option.value) : "") + "\n";
    }
    return lines;
  }

 private:
  void Add(const std::string& key, const std::string& words) {
    if (!pool_.Sets(key)) text_ += "#SBATCH " + words + "\n";
  }

  const PoolFile& pool_;
  std::string text_;
};

std::string SlurmHeader(const PoolFile& pool, const PoolAccess& access) {
  SlurmOptions options(pool);
  options.Set("job-name", access.job_name);
  options.Set("array", "0-" + std::to_string(pool.nodes - 1) +
                           (pool.at_once ? "%" + std::to_string(*pool.at_once) : std::string()));
  options.Set("nodes", "1");
  options.Set("ntasks", "1");
  if (pool.exclusive) {
    options.Flag("exclusive");
    if (!pool.Sets("mem-per-cpu")) options.Set("mem", "0");
  }
  // One slot per core; these options have the same effect.
  if (!pool.Sets("threads-per-core") && !pool.Sets("ntasks-per-core")) options.Set("hint", "nomultithread");
  options.Set("signal", "B:USR1@" + std::to_string(pool.worker.drain_s + kSlurmEarly_s));
  options.Flag(pool.requeue ? "requeue" : "no-requeue");
  options.Set("open-mode", "append");
  options.Set("output", SlurmPatternOf(access.logs) + "/%A_%a.log");  // reader: a filename pattern of Slurm
  options.Set("export", "NONE");
  return options.text();
}

}  // namespace

std::vector<std::string> WorkerArguments(const PoolFile& pool, const PoolAccess& access) {
  std::vector<std::string> arguments;
  const auto add = [&arguments](const std::string& flag, const std::string& value) {
    arguments.insert(arguments.end(), {flag, value});
  };
  add("--access", access.access_file.empty() ? "/dev/fd/" + std::string(kAccessDescriptor) : access.access_file);
  if (!access.key_file.empty()) add("--key-file", access.key_file);
  if (access.key_file.empty() && !access.key.empty()) add("--key-file", "/dev/fd/" + std::string(kKeyDescriptor));
  if (pool.worker.slots) add("--slots", std::to_string(*pool.worker.slots));
  add("--drain", std::to_string(pool.worker.drain_s));
  add("--idle-timeout", std::to_string(pool.worker.idle_timeout_s));
  add("--wait-server", std::to_string(pool.worker.wait_server_s));
  for (const std::string& dataset : access.datasets) add("--dataset", dataset);
  for (const std::string& solver : access.solvers) add("--solver", solver);
  return arguments;
}

std::string WorkerCommand(const PoolFile& pool, const PoolAccess& access, const std::string& name) {
  std::string command = ShellWord(access.program) + " --name \"" + name + "\"";
  for (const std::string& argument : WorkerArguments(pool, access)) command += " " + ShellWord(argument);
  return command;
}

std::string Environment(const PoolAccess& access) {
  return access.data_folder.empty() ? "" : "export LEGOPT_DATA=" + ShellWord(access.data_folder) + "\n";
}

std::string SlurmScript(const PoolFile& pool, const PoolAccess& access) {
  CheckForScript(Engine::kSlurm, pool, access);
  const std::string requeue =
      pool.requeue ? "[ -z \"$time_is_up\" ] || scontrol requeue \"${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID\"\n" : "";
  return "#!/bin/sh\n" + SlurmHeader(pool, access) + Environment(access) + OpenInlineFiles(access) +
         "# USR1, before the time limit, reaches this shell alone; so does the TERM of 'legopt pool stop'. Preemption "
         "and\n"
         "# scancel send TERM to the worker as well, which then releases its jobs at once.\n"
         "trap 'time_is_up=yes; kill -TERM \"$worker\"' USR1\n"
         "trap 'kill -TERM \"$worker\"' TERM\n" +
         WorkerCommand(pool, access, "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID.${SLURM_RESTART_COUNT:-0}") +
         " &\nworker=$!\nstatus=0\n"
         "while kill -0 \"$worker\" 2>/dev/null; do\n  wait \"$worker\"\n  status=$?\ndone\n" +
         requeue + "exit \"$status\"\n";
}

std::string HostScript(const PoolFile& pool, const PoolAccess& access, const std::string& host) {
  CheckForScript(Engine::kSsh, pool, access);
  return "become_a_worker() {\n" + Environment(access) + OpenInlineFiles(access) +
         "# Each line on standard input is an order to stop, and so is its end.\n"
         "exec 5<&0\ntrap '' PIPE\n" +
         WorkerCommand(pool, access, host) +
         " </dev/null 5<&- &\nworker=$!\n"
         "{ while read -r order; do kill -TERM \"$worker\"; done; kill -TERM \"$worker\"; } <&5 >/dev/null 2>&1 &\n"
         "orders=$!\nwait \"$worker\"\nstatus=$?\nkill \"$orders\" 2>/dev/null\nexit \"$status\"\n}\nbecome_a_worker\n";
}

std::string ReadWhole(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw ClientError(ExitCode::kUsage, file + " cannot be read: " + std::strerror(errno));
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::string WithoutKey(std::string script, const PoolAccess& access) {
  if (access.key.empty()) return script;
  const std::string key = access.key.substr(0, access.key.find('\n'));
  for (auto at = script.find(key); at != std::string::npos; at = script.find(key)) {
    script.replace(at, key.size(), "(the key)");
  }
  return script;
}

}  // namespace legopt::client
