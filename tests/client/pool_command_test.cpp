// Policy: a batch system receives exactly the settings of the pool file, and no secrets. Impossible settings are
// refused with file, line, field and remedy, with a separate exit code for each kind of cause. Scripts simulate
// the batch systems; tests/slurm uses a real one.
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <sstream>

#include "command_line_fixture.h"
#include "tests/dataset/test_data.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr int kUnreachable = 3, kRefused = 14, kMachine = 71;

class PoolCommand : public CommandLine {
 protected:
  void SetUp() override {
    ASSERT_EQ(Run({"service", "keygen", "lab.key"}).exit_code, 0);
    // A port without a listener.
    Write("lab.access", "legopt-access 1\ndeployment 4711\naddress 127.0.0.1:9\n");
    fs::permissions(folder_ / "lab.access", fs::perms::owner_read | fs::perms::owner_write);
  }

  // Installs a script as a program of a batch system, first in PATH.
  void Play(const std::string& name, const std::string& body) {
    fs::create_directories(folder_ / "bin");
    const std::string file = Write("bin/" + name, "#!/bin/sh\n" + body);
    fs::permissions(file, fs::perms::owner_all);
  }
  std::map<std::string, std::string> Engines() const {
    return {{"PATH", (folder_ / "bin").string() + ":/usr/bin:/bin"}};
  }

  std::vector<std::string> WithAccess(std::vector<std::string> words) const {
    words.insert(words.end(), {"--access", "lab.access", "--key-file", "lab.key"});
    return words;
  }
  std::string ContentOf(const std::string& name) const {
    std::ifstream file(folder_ / name);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  std::string Key() const {
    std::ifstream file(folder_ / "lab.key");
    std::string key;
    file >> key;
    return key;
  }

  // Expects that the batch system's shell parses the script.
  void ExpectShellReads(const std::string& script) {
    Write("script.sh", script);
    EXPECT_EQ(std::system(("sh -n '" + (folder_ / "script.sh").string() + "'").c_str()), 0) << script;
  }

  ProgramResult DryRun(const std::string& pool) {
    Write("pool.yaml", pool);
    return Run(WithAccess({"pool", "slurm", "pool.yaml", "--dry-run"}));
  }
};

TEST_F(PoolCommand, SlurmIsToldWhatThePoolFileSays) {
  const ProgramResult result = DryRun(R"(slurm:
  nodes: 3
  at_once: 2
  partition: long
  constraint: [zen3, big]
  oversubscribe: true
  comment: two words
worker: {slots: 4, drain_s: 30, dataset: /data/garage}
)");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* line :
       {"#SBATCH --array=0-2%2", "#SBATCH --nodes=1", "#SBATCH --exclusive", "#SBATCH --mem=0", "#SBATCH --requeue",
        "#SBATCH --hint=nomultithread", "#SBATCH --signal=B:USR1@90", "#SBATCH --export=NONE",
        "#SBATCH --open-mode=append", "#SBATCH --job-name=legopt-4711", "#SBATCH --partition=long",
        "#SBATCH --constraint=zen3,big", "#SBATCH --oversubscribe", "#SBATCH --comment='two words'"}) {
    EXPECT_THAT(result.out, HasSubstr(std::string(line) + "\n"));
  }
  EXPECT_THAT(result.out, AllOf(HasSubstr(" --slots 4 "), HasSubstr(" --drain 30 "), HasSubstr("/data/garage")));
  EXPECT_THAT(result.out, Not(HasSubstr(Key())));
  ExpectShellReads(result.out);
}

TEST_F(PoolCommand, WhatTheUserSetsReplacesOurs) {
  const ProgramResult result =
      DryRun("slurm: {nodes: 1, exclusive: false, requeue: false, output: /logs/%j, job-name: mine}\n");
  EXPECT_THAT(result.out, AllOf(HasSubstr("--no-requeue\n"), HasSubstr("--output=/logs/%j\n"),
                                HasSubstr("--job-name=mine\n"), Not(HasSubstr("--exclusive")), Not(HasSubstr("--mem=")),
                                Not(HasSubstr("legopt-4711")), Not(HasSubstr("scontrol requeue"))));
}

TEST_F(PoolCommand, MistakesInPoolFilesAreSaid) {
  const auto refused = [this](const std::string& pool, const std::vector<std::string>& words) {
    const ProgramResult result = DryRun(pool);
    for (const std::string& word : words) ExpectError(result, kUsage, word);
  };
  refused("slurm: {node: 2}\n", {"pool.yaml:1: slurm.node", "nodes"});
  refused("slurn: {nodes: 2}\n", {"pool.yaml:1: slurn", "did you mean 'slurm'"});
  refused("slurm:\n  nodes: 0\n", {"pool.yaml:2: slurm.nodes", "got '0'"});
  refused("slurm: {nodes: many}\n", {"slurm.nodes", "many"});
  refused("slurm: {nodes: 1, signal: TERM}\n", {"slurm.signal", "drain_s"});
  refused("slurm: {nodes: 1, --partition: long}\n", {"slurm.--partition", "without dashes"});
  refused("slurm: {nodes: 1, comment: \"a\\nb\"}\n", {"slurm.comment", "control character"});
  refused("slurm: {nodes: 1}\nworker: {slot: 2}\n", {"pool.yaml:2: worker.slot", "did you mean 'slots'"});
  refused("slurm: {nodes: 1}\nworker: {key_file: lab.key}\n", {"worker.key_file", "begins with '/'"});
  refused("slurm: {nodes: 1}\nserver: {port: 1}\n", {"server.port", "listen"});
  refused("nothing: 1\n", {"pool.yaml:1: nothing"});
  refused("slurm: [", {"pool.yaml"});
  ExpectError(Run(WithAccess({"pool", "slurm", "missing.yaml"})), kUsage, "missing.yaml: cannot be read");
}

TEST_F(PoolCommand, AServerThatDoesNotAnswerIsNamed) {
  Write("pool.yaml", "slurm: {nodes: 2}\n");
  Play("sbatch", "echo submitted >&2\nexit 1\n");
  const ProgramResult result = RunLegopt(WithAccess({"pool", "slurm", "pool.yaml"}), folder_.path(), Engines());
  ExpectError(result, kUnreachable, "127.0.0.1:9");
  EXPECT_THAT(result.err, AllOf(HasSubstr("lab.key"), Not(HasSubstr("submitted"))));
}

TEST_F(PoolCommand, WithoutSlurmNothingIsStarted) {
  Write("pool.yaml", "slurm: {nodes: 2}\n");
  const ProgramResult result =
      Run({"run", "quick", "--slurm", "pool.yaml", "--db", "run.sqlite"}, {{"PATH", "/nowhere"}});
  ExpectError(result, kMachine, "sbatch is not on PATH");
  EXPECT_FALSE(fs::exists(folder_ / "run.sqlite"));
}

TEST_F(PoolCommand, ADryRunShowsTheScriptAndStartsNothing) {
  Write("pool.yaml", "slurm: {nodes: 2, partition: long}\n");
  const ProgramResult result = Run({"run", "quick", "--slurm", "pool.yaml", "--db", "run.sqlite", "--dry-run"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("550 jobs"), HasSubstr("#SBATCH --partition=long\n"), HasSubstr("(the key)"),
                                HasSubstr("nothing was started")));
  EXPECT_FALSE(fs::exists(folder_ / "run.sqlite.pool"));
}

TEST_F(PoolCommand, WhatSlurmRefusesIsBlamedOnTheLineThatAsksForIt) {
  Write("pool.yaml", "slurm:\n  nodes: 2\n  partition: nowhere\n");
  Play("sbatch", "cat >/dev/null\necho 'sbatch: error: invalid partition specified: nowhere' >&2\nexit 1\n");
  Play("squeue", "exit 0\n");
  Play("scancel", "exit 0\n");
  const ProgramResult result = Run({"run", "quick", "--slurm", "pool.yaml", "--db", "run.sqlite"}, Engines());
  EXPECT_EQ(result.exit_code, kRefused) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("pool.yaml:3: slurm.partition: is refused (got 'nowhere')"),
                                HasSubstr("Slurm says: sbatch: error: invalid partition specified")));
}

TEST_F(PoolCommand, NoDatasetHoldsForTheServerOfASlurmRun) {
  Write("pool.yaml", "slurm: {nodes: 2}\n");
  const auto seen = folder_ / "server.txt";
  Play("sbatch",
       "for child in $(cat /proc/$PPID/task/$PPID/children); do tr '\\0' ' ' < /proc/$child/cmdline; echo; done | "
       "grep legopt-server > '" +
           seen.string() + "'\ncat >/dev/null\nexit 1\n");
  Play("squeue", "exit 0\n");
  Play("scancel", "exit 0\n");
  Run({"run", "quick", "--slurm", "pool.yaml", "--db", "run.sqlite"}, Engines());
  EXPECT_THAT(test::ReadText(seen), AllOf(HasSubstr("--datasets"), Not(HasSubstr("--no-dataset"))));
  Run({"run", "quick", "--slurm", "pool.yaml", "--db", "bare.sqlite", "--no-dataset"}, Engines());
  EXPECT_THAT(test::ReadText(seen), AllOf(HasSubstr("--datasets"), HasSubstr("--no-dataset")));
}

TEST_F(PoolCommand, OtherEnginesGetAScriptWithPathsAndWithoutTheKey) {
  Write("pool.yaml",
        "pbs: {nodes: 4, q: long, walltime: 1:00:00}\nsge: {nodes: 4, at_once: 2, pe: smp 8, h_rt: 3600}\n"
        "htcondor: {nodes: 4, request_cpus: 8, requirements: 'OpSysAndVer == \"Debian12\"'}\n");
  const std::map<std::string, std::vector<std::string>> expected = {
      {"pbs", {"#PBS -J 0-3\n", "#PBS -q long\n", "#PBS -l walltime=1:00:00\n", "#PBS -r y\n", "exec "}},
      {"sge", {"#$ -t 1-4\n", "#$ -tc 2\n", "#$ -pe smp 8\n", "#$ -l h_rt=3600\n", "exec "}},
      {"htcondor", {"queue 4\n", "request_cpus = 8\n", "OpSysAndVer == \"Debian12\"", "transfer_input_files = "}}};
  for (const auto& [engine, lines] : expected) {
    const ProgramResult result = Run(WithAccess({"pool", "script", "pool.yaml", "--engine", engine}));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    for (const std::string& line : lines) EXPECT_THAT(result.out, HasSubstr(line)) << engine;
    EXPECT_THAT(result.out, AllOf(HasSubstr("lab.access"), HasSubstr("worker.key"), Not(HasSubstr("lab.key"))))
        << engine;
    EXPECT_THAT(result.out, Not(HasSubstr(Key()))) << engine;
    if (engine != "htcondor") ExpectShellReads(result.out);
  }
}

// Nodes receive only the worker's key, by each mechanism.
TEST_F(PoolCommand, NodesGetTheWorkersKeyOnly) {
  Write("pool.yaml", "slurm: {nodes: 1}\npbs: {nodes: 1}\n");
  ASSERT_EQ(Run({"service", "keygen", "w.key", "--role", "worker", "--from", "lab.key"}).exit_code, 0);
  ASSERT_EQ(Run({"service", "keygen", "c.key", "--role", "client", "--from", "lab.key"}).exit_code, 0);
  const std::string worker_key = ContentOf("w.key");
  EXPECT_THAT(worker_key, testing::MatchesRegex("worker [0-9a-f]+\n"));
  // A key file that the script names.
  const auto print = [this](const std::string& key) {
    return Run({"pool", "script", "pool.yaml", "--engine", "pbs", "--access", "lab.access", "--key-file", key,
                "--folder", "nodes"});
  };
  ProgramResult result = print("lab.key");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr((folder_ / "nodes" / "worker.key").string()));
  EXPECT_EQ(ContentOf("nodes/worker.key"), worker_key);
  EXPECT_EQ(fs::status(folder_ / "nodes" / "worker.key").permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(print("lab.key").exit_code, 0) << "once more";
  result = print("w.key");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr((folder_ / "w.key").string()));
  ExpectError(print("c.key"), kUsage,
              "holds a client's key; workers need the full key of the deployment, or a worker's");
  ASSERT_EQ(Run({"service", "keygen", "other.key"}).exit_code, 0);
  ExpectError(print("other.key"), kUsage, "is not the worker's key of \"other.key\"");
  // A key embedded in a script.
  const std::vector<std::string> slurm = {"pool", "slurm", "pool.yaml", "--access", "lab.access", "--key-file"};
  const auto dry_run = [&](const std::string& key) {
    std::vector<std::string> words = slurm;
    words.insert(words.end(), {key, "--dry-run"});
    return Run(words);
  };
  for (const char* key : {"lab.key", "w.key"}) {
    result = dry_run(key);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, AllOf(HasSubstr("(the key)"), Not(HasSubstr(Key())),
                                  Not(HasSubstr(worker_key.substr(0, worker_key.size() - 1)))));
  }
  ExpectError(dry_run("c.key"), kUsage, "holds a client's key");
}

TEST_F(PoolCommand, KeysOfRolesAreDerivedFromTheFullKeyOnly) {
  ASSERT_EQ(Run({"service", "keygen", "w.key", "--role", "worker", "--from", "lab.key"}).exit_code, 0);
  ExpectError(Run({"service", "keygen", "w.key", "--role", "worker", "--from", "lab.key"}), kUsage, "w.key");
  ExpectError(Run({"service", "keygen", "x.key", "--role", "client", "--from", "w.key"}), kUsage,
              "\"w.key\" holds a worker's key; keys of roles are derived from the full key only");
  ExpectError(Run({"service", "keygen", "x.key", "--role", "worker", "--from", "w.key"}), kUsage,
              "holds a worker's key");
  EXPECT_EQ(Run({"service", "keygen", "x.key", "--role", "worker"}).exit_code, 2);
  EXPECT_EQ(Run({"service", "keygen", "x.key", "--from", "lab.key"}).exit_code, 2);
  EXPECT_EQ(Run({"service", "keygen", "x.key", "--role", "operator", "--from", "lab.key"}).exit_code, 2);
  EXPECT_FALSE(fs::exists(folder_ / "x.key"));
}

// Splits a line into words by /bin/sh, whose quoting agrees with that of sbatch and qsub for these values.
std::vector<std::string> ShellWords(const std::string& line) {
  std::vector<std::string> words;
  const std::string command = "printf '%s\\n' " + line;
  std::FILE* output = ::popen(command.c_str(), "r");
  for (std::array<char, 1000> text{}; std::fgets(text.data(), text.size(), output) != nullptr;) {
    words.emplace_back(text.data());
    words.back().pop_back();
  }
  ::pclose(output);
  return words;
}

std::string LineWith(const std::string& script, const std::string& begin) {
  const auto at = script.find(begin);
  return at == std::string::npos ? "" : script.substr(at, script.find('\n', at) - at);
}

// The folder contains blanks and quotes and remains one word.
TEST_F(PoolCommand, EveryValueIsQuotedAsItsEngineReadsIt) {
  Write("pool.yaml",
        "slurm: {nodes: 1}\npbs: {nodes: 1}\nsge: {nodes: 1, pe: smp 8, arch: 'lx|sol'}\n"
        "htcondor: {nodes: 1}\nworker: {dataset: \"/it's $HOME\"}\n");
  const std::string folder = (folder_ / "a b#%;$(x)\"c").string();
  std::vector<std::string> arguments = WithAccess({"pool", "slurm", "pool.yaml", "--dry-run", "--folder", folder});
  ProgramResult result = Run(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::string pattern = folder + "/%A_%a.log";
  pattern.replace(pattern.find("#%"), 2, "#%%");
  EXPECT_THAT(ShellWords(LineWith(result.out, "#SBATCH --output").substr(std::string("#SBATCH ").size())),
              testing::ElementsAre("--output=" + pattern));
  ExpectShellReads(result.out);
  EXPECT_THAT(result.out, HasSubstr("--dataset '/it'\\''s $HOME'"));

  arguments = WithAccess({"pool", "script", "pool.yaml", "--folder", folder, "--engine", "pbs"});
  result = Run(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(ShellWords(LineWith(result.out, "#PBS -o").substr(std::string("#PBS ").size())),
              testing::ElementsAre("-o", folder));
  arguments[6] = "htcondor";
  result = Run(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("a b#%;$(DOLLAR)(x)\"c/$(ClusterId)"), HasSubstr("'/it''s $(DOLLAR)HOME'")));
  arguments[6] = "sge";
  result = Run(arguments);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("holds '$', which this engine interprets"));
  arguments[4] = (folder_ / "a b").string();
  result = Run(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("#$ -o '" + arguments[4] + "'\n"), HasSubstr("#$ -pe smp 8\n"),
                                HasSubstr("#$ -l 'arch=lx|sol'\n")));
}

TEST_F(PoolCommand, ALineEndInAnyValueIsRefused) {
  const std::string pool =
      "slurm: {nodes: 1}\npbs: {nodes: 1}\nsge: {nodes: 1}\nhtcondor: {nodes: 1}\nssh: {hosts: [one]}\n";
  const auto refuse = [this](std::vector<std::string> arguments) {
    for (const char* engine : {"slurm", "ssh", "pbs", "sge", "htcondor"}) {
      std::vector<std::string> all = {"pool", engine, "pool.yaml", "--dry-run"};
      if (engine[1] != 'l' && engine[1] != 's') all = {"pool", "script", "pool.yaml", "--engine", engine};
      all.insert(all.end(), arguments.begin(), arguments.end());
      const ProgramResult result = Run(WithAccess(all));
      EXPECT_EQ(result.exit_code, 2) << engine << result.out;
      EXPECT_THAT(result.err, HasSubstr("control character")) << engine;
      EXPECT_THAT(result.out, testing::IsEmpty()) << engine;
    }
  };
  Write("pool.yaml", pool);
  refuse({"--folder", "logs\ntouch planted"});
  Write("pool.yaml", pool + "worker: {dataset: \"/a\\nb\"}\n");
  refuse({});
  Write("pool.yaml", pool + "worker: {program: \"/a\\x7Fb\"}\n");
  refuse({});
}

// --- ssh -------------------------------------------------------------------------------------------------------------

TEST_F(PoolCommand, HostsMayStandInAFileOfTheirOwn) {
  Write("lab.hosts", "# the lab\nann@one\n\n two # a note\n");
  Write("pool.yaml", "ssh: {hosts_file: lab.hosts, Port: 2222}\n");
  const ProgramResult result = Run(WithAccess({"pool", "ssh", "pool.yaml", "--dry-run"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("# ssh -T -o 'Port=2222' -o 'BatchMode=yes'"), HasSubstr("-- ann@one"),
                                HasSubstr("-- two"), Not(HasSubstr(Key()))));
  ExpectShellReads(result.out);
}

TEST_F(PoolCommand, MistakesInHostsAreSaid) {
  const auto refused = [this](const std::string& pool, const std::string& words) {
    Write("pool.yaml", pool);
    ExpectError(Run(WithAccess({"pool", "ssh", "pool.yaml", "--dry-run"})), kUsage, words);
  };
  Write("bad.hosts", "one\ntwo three\n");
  Write("no.hosts", "# none\n");
  refused("ssh: {hosts: ['-oProxyCommand=x']}\n", "pool.yaml:1: ssh.hosts");
  refused("ssh: {hosts: [one, one]}\n", "names a host twice");
  refused("ssh: {host: [one]}\n", "hosts");
  refused("ssh: {hosts_file: missing.hosts}\n", "missing.hosts: cannot be read");
  refused("ssh: {hosts_file: bad.hosts}\n", "bad.hosts:2: is no host");
  refused("ssh: {hosts_file: no.hosts}\n", "names no host");
}

TEST_F(PoolCommand, AFolderThatIsNoPoolIsSaid) {
  ExpectError(Run({"pool", "status", "nowhere"}), kUsage, "nowhere is no folder of a pool");
  fs::create_directory(folder_ / "pool");
  Write("pool/jobs", "slurm 17; rm -rf /\n");
  ExpectError(Run({"pool", "stop", "pool"}), kUsage, "no line 'ENGINE NUMBER'");
}

TEST_F(PoolCommand, AnEngineThatDoesNotAnswerIsNotWaitedForForEver) {
  fs::create_directory(folder_ / "pool");
  Write("pool/jobs", "slurm 17\n");
  Play("squeue", "echo 'slurm_load_jobs error: Unable to contact slurm controller' >&2\nexit 1\n");
  const ProgramResult result = Run({"pool", "status", "pool"}, Engines());
  ExpectError(result, kRefused, "Slurm does not say how job 17 is");
}

// Another program of this machine that runs: its number and start, as the record has them.
std::string StartOf(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()}, word;
  std::istringstream fields(text.substr(text.rfind(')') + 1));
  constexpr int kStart = 20;  // number of the field after the name
  for (int i = 0; i < kStart; ++i) fields >> word;
  return word;
}

TEST_F(PoolCommand, KeepersOfOneFolderHaveHostsOfTheirOwn) {
  fs::create_directory(folder_ / "pool");
  std::string jobs;
  for (const pid_t pid : {getpid(), getppid()}) {
    jobs += "ssh " + std::to_string(pid) + " " + StartOf(pid) + "\n";
    Write("pool/hosts-" + std::to_string(pid), "of-" + std::to_string(pid) + "\t0\tconnected\n");
  }
  Write("pool/jobs", jobs);
  const ProgramResult status = Run({"pool", "status", "pool", "--format", "csv"});
  EXPECT_EQ(status.exit_code, 0) << status.err;
  for (const pid_t pid : {getpid(), getppid()}) {
    EXPECT_THAT(status.out, HasSubstr("\nof-" + std::to_string(pid) + ",connected,"));
  }
}

TEST_F(PoolCommand, AKeeperThatHasEndedHasNoHosts) {
  fs::create_directory(folder_ / "pool");
  Write("pool/jobs", "ssh " + std::to_string(getpid()) + " 1\n");  // our process id with a different start time
  Write("pool/hosts-" + std::to_string(getpid()), "one\t0\tconnected\n");
  const ProgramResult status = Run({"pool", "status", "pool", "--format", "csv"});
  EXPECT_EQ(status.exit_code, 0) << status.err;
  EXPECT_EQ(status.out, "worker,state,time,node\n");
  EXPECT_EQ(Run({"pool", "stop", "pool"}).exit_code, 0) << "or this test is dead";
}

}  // namespace
}  // namespace legopt::client
