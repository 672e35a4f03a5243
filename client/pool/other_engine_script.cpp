#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "client/pool/pool_script.h"
#include "client/pool/script_quoting.h"
#include "client/pool/worker_command.h"
#include "legopt/types/classic_stream.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
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
  return text + Environment(access) + "exec " + WorkerCommand(pool, access, "$PBS_JOBID") + "\n";
}

std::string GridEngineScript(const PoolFile& pool, const PoolAccess& access) {
  std::string text = "#!/bin/sh\n#$ -S /bin/sh\n#$ -N " + QsubWord(access.job_name) + "\n";
  text += "#$ -t 1-" + std::to_string(pool.nodes) + "\n";
  if (pool.at_once) text += "#$ -tc " + std::to_string(*pool.at_once) + "\n";
  if (pool.exclusive && !pool.Sets("exclusive")) text += "#$ -l exclusive=true\n";
  text += std::string("#$ -r ") + (pool.requeue ? "y" : "n") + "\n#$ -j y\n#$ -o " + QsubWord(access.logs) + "\n";
  for (const EngineOption& option : pool.options) text += QsubOption("#$", option);
  return text + Environment(access) + "exec " + WorkerCommand(pool, access, "${JOB_ID}_$SGE_TASK_ID.${RESTARTED:-0}") +
         "\n";
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
