#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "client/service/child_process.h"
#include "db/read_only_database.h"
#include "tests/figures/figures.h"
#include "tests/figures/filled_database.h"
#include "tests/figures/process_facts.h"

namespace legopt::figures {
namespace {

using service::Deployment;
using std::chrono::minutes;
using std::chrono::seconds;

constexpr int kFileRows = 100'000;
constexpr int kFileOpenJobs = 1000;
constexpr double kReady_s = 2;

// The slowest start, and the highest CPU time of one, which is the meaningful figure on a loaded machine.
struct Starts {
  double slowest_s = 0;
  double most_cpu_s = 0;

  void Make(Deployment& deployment) {
    const auto begin = Clock::now();
    deployment.StartServer();
    slowest_s = std::max(slowest_s, SecondsSince(begin));
    most_cpu_s = std::max(most_cpu_s, FactsOf(deployment.server().pid()).cpu_s);
  }
};

// Returns the seconds of one run of `legopt`, which must succeed.
double TimeClient(const std::vector<std::string>& arguments, const std::string& what, Findings& findings) {
  const auto begin = Clock::now();
  client::ChildProcess program(service::Program("legopt"), arguments, true);
  const auto exit = program.Wait(minutes(10));
  const double took_s = SecondsSince(begin);
  const bool good = exit && exit->signal == 0 && exit->code == 0;
  findings.Promise(good, what + (good ? ": " + std::to_string(took_s) + " s" : ": " + program.ErrorTail()));
  return took_s;
}

std::int64_t CountResults(const std::filesystem::path& file) {
  const auto answer = db::ReadOnlyDatabase(file).Query("SELECT count(*) FROM results", 1);
  return std::get<std::int64_t>(answer.rows.at(0).at(0));
}

// Performs the drill of docs/how-to/back-up.md: moves the file and its log away, replaces them by a backup, and
// restarts the server.
void MeasureRestore(Deployment& deployment, int rows, Findings& findings) {
  findings.Begin("20");
  const std::filesystem::path file = deployment.database();
  const std::filesystem::path copy = deployment.folder() / "copy.sqlite";
  TimeClient({"service", "backup", "--db", file.string(), copy.string()}, "backup of a live file", findings);
  const auto size_mb = static_cast<double>(std::filesystem::file_size(copy)) / (1 << 20);
  findings.Note("the copy has " + std::to_string(size_mb) + " MiB, " + std::to_string(rows) + " results");
  TimeClient({"service", "doctor", "--db", copy.string(), "--timeout", "1"}, "check of the copy", findings);
  deployment.KillServer();
  const auto begin = Clock::now();
  for (const char* suffix : {"", "-wal", "-shm"}) {
    const std::filesystem::path part = file.string() + suffix;
    if (std::filesystem::exists(part)) std::filesystem::rename(part, part.string() + ".damaged");
  }
  std::filesystem::copy_file(copy, file);
  deployment.StartServer();
  const double restored_s = SecondsSince(begin);
  findings.Promise(CountResults(file) == rows, "every result is there again");
  findings.Note("restore, from the move to \"ready\": " + std::to_string(restored_s) + " s");
}

}  // namespace

void MeasureLargeFile(const Request& request, Findings& findings) {
  const int rows = request.count > 0 ? request.count : kFileRows;
  constexpr int kStarts = 5;
  const auto deployment = FilledDeployment(rows, kFileOpenJobs);
  findings.Begin("17");
  Starts starts;
  starts.Make(*deployment);
  for (int start = 1; start < kStarts; ++start) {
    const auto worker = deployment->StartStubWorker();
    deployment->WaitForJobs(1, rows + 20 * start);  // the log is not empty
    deployment->KillServer();
    starts.Make(*deployment);
    worker->Stop(seconds(20));  // delivers its results; nothing changes once results are counted
  }
  const std::int64_t results = CountResults(deployment->database());
  findings.Promise(results >= rows, std::to_string(results) + " result rows, " + std::to_string(kStarts - 1) +
                                        " SIGKILLs of the server at work");
  findings.Quantity("slowest of " + std::to_string(kStarts) + " starts, to \"ready\",", starts.slowest_s, kReady_s,
                    "s");
  findings.Quantity("CPU time of a start, at most,", starts.most_cpu_s, kReady_s, "s");
  MeasureRestore(*deployment, static_cast<int>(results), findings);
}

}  // namespace legopt::figures
