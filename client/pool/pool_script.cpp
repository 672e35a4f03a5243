#include "client/pool/pool_script.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "app/printable.h"
#include "client/client_error.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

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

std::string EnvironmentLine(const PoolAccess& access) {
  return access.data_folder.empty() ? "" : "export LEGOPT_DATA=" + ShellWord(access.data_folder) + "\n";
}

std::string SlurmScript(const PoolFile& pool, const PoolAccess& access) {
  CheckForScript(Engine::kSlurm, pool, access);
  const std::string requeue =
      pool.requeue ? "[ -z \"$time_is_up\" ] || scontrol requeue \"${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID\"\n" : "";
  return "#!/bin/sh\n" + SlurmHeader(pool, access) + EnvironmentLine(access) + OpenInlineFiles(access) +
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
  return "become_a_worker() {\n" + EnvironmentLine(access) + OpenInlineFiles(access) +
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

namespace {

constexpr std::string_view kPlainCharacters =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./+,:=@%&~*";

bool IsPlainWord(const std::string& value) {
  return !value.empty() && value.find_first_not_of(kPlainCharacters) == std::string::npos;
}

bool HasControls(const std::string& value) {
  constexpr unsigned char kDelete = 0x7F;
  return std::ranges::any_of(value, [](unsigned char c) { return c < ' ' || c == kDelete; });
}

// Returns `text` with every `c` replaced by `replacement`.
std::string Replaced(const std::string& text, char c, std::string_view replacement) {
  std::string result;
  for (const char each : text) {
    if (each == c) {
      result += replacement;
    } else {
      result += each;
    }
  }
  return result;
}

void RefuseControls(const std::string& field, const std::string& value) {
  if (!HasControls(value)) return;
  throw InputError({"", field, value, "holds a line end or another control character, which no job script can hold",
                    "rename the file or folder"});
}

// Characters that the batch system interprets in log paths.
std::string_view SpecialInLogs(Engine engine) {
  switch (engine) {
    case Engine::kSlurm:
      return "\\";
    case Engine::kPbs:
      return ":";
    case Engine::kSge:
      return ":,$";
    case Engine::kHtcondor:
    case Engine::kSsh:
      break;
  }
  return "";
}

}  // namespace

void CheckForScript(Engine engine, const PoolFile& pool, const PoolAccess& access) {
  RefuseControls("access file", access.access_file);
  RefuseControls("key file", access.key_file);
  RefuseControls("worker.program", access.program);
  RefuseControls("LEGOPT_DATA", access.data_folder);
  RefuseControls("folder of logs", access.logs);
  RefuseControls("job name", access.job_name);
  for (const std::string& dataset : access.datasets) RefuseControls("worker.dataset", dataset);
  for (const std::string& solver : access.solvers) RefuseControls("--solver", solver);
  for (const std::string& host : pool.hosts) RefuseControls("ssh.hosts", host);
  for (const EngineOption& option : pool.options) RefuseControls(option.key, option.value.value_or(""));
  const std::string_view special = SpecialInLogs(engine);
  if (const auto at = access.logs.find_first_of(special); at != std::string::npos) {
    throw InputError({"", "folder of logs", access.logs,
                      std::string("holds '") + access.logs[at] + "', which this engine interprets in a path",
                      "choose another folder (--folder; of 'legopt run --slurm': --db)"});
  }
}

std::string SlurmWord(const std::string& value) {
  if (IsPlainWord(value)) return value;
  return "'" + Replaced(Replaced(value, '\\', "\\\\"), '\'', "\\'") + "'";
}

std::string SlurmPatternOf(const std::string& path) { return Replaced(path, '%', "%%"); }

std::string QsubWord(const std::string& value) {
  if (IsPlainWord(value)) return value;
  const char quote = value.find('\'') == std::string::npos ? '\'' : '"';
  if (value.find('\\') != std::string::npos || (quote == '"' && value.find('"') != std::string::npos)) {
    throw InputError({"", "", value, "holds a backslash or both kinds of quotes, which a line for qsub cannot hold",
                      "rename the file or folder"});
  }
  return quote + value + quote;
}

std::string CondorWord(const std::string& value) {
  const std::string literal = CondorValue(value);
  if (IsPlainWord(value)) return literal;
  return "'" + Replaced(Replaced(literal, '\'', "''"), '"', "\"\"") + "'";
}

std::string CondorValue(const std::string& value) { return Replaced(value, '$', "$(DOLLAR)"); }

namespace {

// Long qsub options; all other long keys are resources, '-l KEY=VALUE'.
constexpr std::array<std::string_view, 4> kGridEngineOptions = {"pe", "wd", "ar", "hold_jid"};

// A parallel environment has two words: its name and the number of slots.
std::string QsubValue(const EngineOption& option) {
  if (option.key != "pe") return QsubWord(option.value.value_or(""));
  ClassicInput words(option.value.value_or(""));
  std::string text;
  for (std::string word; words >> word;) text += (text.empty() ? "" : " ") + QsubWord(word);
  return text;
}

std::string QsubOption(const std::string& mark, const EngineOption& option) {
  bool is_option = option.key.size() == 1;
  for (const std::string_view word : kGridEngineOptions) is_option = is_option || option.key == word;
  const std::string value = option.value.value_or("");
  if (is_option) return mark + " -" + option.key + (value.empty() ? "" : " " + QsubValue(option)) + "\n";
  return mark + " -l " + QsubWord(option.key + "=" + (value.empty() ? "true" : value)) + "\n";
}

std::string PbsScript(const PoolFile& pool, const PoolAccess& access) {
  std::string text = "#!/bin/sh\n#PBS -N " + QsubWord(access.job_name) + "\n";
  if (pool.nodes > 1)
    text += "#PBS -J 0-" + std::to_string(pool.nodes - 1) + "\n";  // PBS does not accept arrays of
                                                                   // one element
  if (pool.exclusive && !pool.Sets("place")) text += "#PBS -l place=excl\n";
  text +=
      std::string("#PBS -r ") + (pool.requeue ? "y" : "n") + "\n#PBS -j oe\n#PBS -o " + QsubWord(access.logs) + "\n";
  for (const EngineOption& option : pool.options) text += QsubOption("#PBS", option);
  return text + EnvironmentLine(access) + "exec " + WorkerCommand(pool, access, "$PBS_JOBID") + "\n";
}

std::string GridEngineScript(const PoolFile& pool, const PoolAccess& access) {
  std::string text = "#!/bin/sh\n#$ -S /bin/sh\n#$ -N " + QsubWord(access.job_name) + "\n";
  text += "#$ -t 1-" + std::to_string(pool.nodes) + "\n";
  if (pool.at_once) text += "#$ -tc " + std::to_string(*pool.at_once) + "\n";
  if (pool.exclusive && !pool.Sets("exclusive")) text += "#$ -l exclusive=true\n";
  text += std::string("#$ -r ") + (pool.requeue ? "y" : "n") + "\n#$ -j y\n#$ -o " + QsubWord(access.logs) + "\n";
  for (const EngineOption& option : pool.options) text += QsubOption("#$", option);
  return text + EnvironmentLine(access) + "exec " +
         WorkerCommand(pool, access, "${JOB_ID}_$SGE_TASK_ID.${RESTARTED:-0}") + "\n";
}

// In lists of transferred files, names are separated by commas.
std::string TransferredFile(const std::string& file) {
  if (file.find(',') == std::string::npos) return CondorValue(file);
  throw InputError({"", "", file, "holds a comma, which separates files in a description for condor_submit",
                    "rename the file or its folder"});
}

// condor_submit splits this line at spaces.
std::string CondorArguments(const std::vector<std::string>& arguments) {
  std::string text = "--name $(ClusterId)_$(ProcId)";
  for (const std::string& argument : arguments) text += " " + CondorWord(argument);
  return "arguments = \"" + text + "\"\n";
}

std::string CondorScript(const PoolFile& pool, const PoolAccess& access) {
  // The files are transferred with the job, under their own names.
  PoolAccess on_node = access;
  on_node.access_file = std::filesystem::path(access.access_file).filename();
  if (!access.key_file.empty()) on_node.key_file = std::filesystem::path(access.key_file).filename();
  std::string text = "executable = " + CondorValue(access.program) + "\ntransfer_executable = false\n";
  text += CondorArguments(WorkerArguments(pool, on_node));
  text += "should_transfer_files = YES\ntransfer_input_files = " + TransferredFile(access.access_file);
  text += (access.key_file.empty() ? "" : ", " + TransferredFile(access.key_file)) + "\n";
  text += "kill_sig = SIGTERM\njob_max_vacate_time = " + std::to_string(pool.worker.drain_s) + "\n";
  if (!access.data_folder.empty()) {
    text += "environment = \"" + CondorWord("LEGOPT_DATA=" + access.data_folder) + "\"\n";
  }
  for (const char* stream : {"output", "error", "log"}) {
    if (!pool.Sets(stream)) {
      text += std::string(stream) + " = " + CondorValue(access.logs) + "/$(ClusterId)_$(ProcId)." + stream + "\n";
    }
  }
  for (const EngineOption& option : pool.options) text += option.key + " = " + option.value.value_or("true") + "\n";
  return text + "queue " + std::to_string(pool.nodes) + "\n";
}

}  // namespace

std::string OtherEngineScript(Engine engine, const PoolFile& pool, const PoolAccess& access) {
  if (access.access_file.empty() || !access.key.empty()) {
    throw InputError({"", "", "", "a script in a file must not hold what travels in it",
                      "give --access and --key-file, and keep both where the nodes see them"});
  }
  CheckForScript(engine, pool, access);
  switch (engine) {
    case Engine::kPbs:
      return PbsScript(pool, access);
    case Engine::kSge:
      return GridEngineScript(pool, access);
    case Engine::kHtcondor:
      return CondorScript(pool, access);
    case Engine::kSlurm:
    case Engine::kSsh:
      break;
  }
  return SlurmScript(pool, access);
}

}  // namespace legopt::client
