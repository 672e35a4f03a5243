#include <array>
#include <filesystem>
#include <string>
#include <string_view>

#include "client/pool/pool_script.h"
#include "client/pool/worker_command.h"
#include "legopt/input_error.h"
#include "programs/shell_word.h"

namespace legopt::client {
namespace {

using programs::ShellWord;

// Options of qsub with words; all other long keys are resources, '-l KEY=VALUE'.
constexpr std::array<std::string_view, 4> kGridEngineOptions = {"pe", "wd", "ar", "hold_jid"};

std::string QsubOption(const std::string& mark, const EngineOption& option) {
  bool is_option = option.key.size() == 1;
  for (const std::string_view word : kGridEngineOptions) is_option = is_option || option.key == word;
  const std::string value = option.value.value_or("");
  if (is_option) return mark + " -" + option.key + (value.empty() ? "" : " " + value) + "\n";
  return mark + " -l " + option.key + (value.empty() ? "=true" : "=" + value) + "\n";
}

std::string PbsScript(const PoolFile& pool, const PoolAccess& access) {
  std::string text = "#!/bin/sh\n#PBS -N " + access.job_name + "\n";
  if (pool.nodes > 1) text += "#PBS -J 0-" + std::to_string(pool.nodes - 1) + "\n";  // no array of one
  if (pool.exclusive && !pool.Sets("place")) text += "#PBS -l place=excl\n";
  text += std::string("#PBS -r ") + (pool.requeue ? "y" : "n") + "\n#PBS -j oe\n#PBS -o " + access.logs + "\n";
  for (const EngineOption& option : pool.options) text += QsubOption("#PBS", option);
  return text + Environment(access) + "exec " + WorkerCommand(pool, access, "$PBS_JOBID") + "\n";
}

std::string GridEngineScript(const PoolFile& pool, const PoolAccess& access) {
  std::string text = "#!/bin/sh\n#$ -S /bin/sh\n#$ -N " + access.job_name + "\n";
  text += "#$ -t 1-" + std::to_string(pool.nodes) + "\n";
  if (pool.at_once) text += "#$ -tc " + std::to_string(*pool.at_once) + "\n";
  if (pool.exclusive && !pool.Sets("exclusive")) text += "#$ -l exclusive=true\n";
  text += std::string("#$ -r ") + (pool.requeue ? "y" : "n") + "\n#$ -j y\n#$ -o " + access.logs + "\n";
  for (const EngineOption& option : pool.options) text += QsubOption("#$", option);
  return text + Environment(access) + "exec " + WorkerCommand(pool, access, "${JOB_ID}_$SGE_TASK_ID.${RESTARTED:-0}") +
         "\n";
}

// One that condor_submit takes apart at blanks, with single quotes around those that hold some.
std::string CondorScript(const PoolFile& pool, const PoolAccess& access) {
  // The files come along with the job, under their own names.
  PoolAccess on_node = access;
  on_node.access_file = std::filesystem::path(access.access_file).filename();
  if (!access.key_file.empty()) on_node.key_file = std::filesystem::path(access.key_file).filename();
  const std::string command = WorkerCommand(pool, on_node, "");
  const std::string arguments = command.substr(command.find(" --access") + 1);
  std::string text = "executable = " + access.program + "\ntransfer_executable = false\n";
  text += "arguments = \"--name $(ClusterId)_$(ProcId) " + arguments + "\"\n";
  text += "should_transfer_files = YES\ntransfer_input_files = " + access.access_file;
  text += (access.key_file.empty() ? "" : ", " + access.key_file) + "\n";
  text += "kill_sig = SIGTERM\njob_max_vacate_time = " + std::to_string(pool.worker.drain_s) + "\n";
  if (!access.data_folder.empty()) text += "environment = \"LEGOPT_DATA=" + ShellWord(access.data_folder) + "\"\n";
  for (const char* stream : {"output", "error", "log"}) {
    if (!pool.Sets(stream)) {
      text += std::string(stream) + " = " + access.logs + "/$(ClusterId)_$(ProcId)." + stream + "\n";
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
