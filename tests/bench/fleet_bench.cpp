// Cost of a server for a large fleet: real server code on a real database file, hundreds of real worker pools, and a
// simulated network in virtual time. Prints the server's CPU time per result, the share of a core it uses at the
// fleet's rate, and the memory of the whole process during the run.
//
//   fleet_bench [--workers 500] [--slots 1] [--jobs 1000000] [--experiments 1] [--job-ms 250] [--keyed]
//
// With --restart, measures how long a server needs after an outage of 3 s until every worker has registered again, and
// the CPU time of that. The virtual time per datagram and the receive buffer are options; the CPU time is measured:
//
//   fleet_bench --restart [--workers 500] [--keyed] [--datagram-us 25] [--buffer 550]
//
// All work of the server's thread is included except the kernel's work for UDP sockets, which server_bench measures.

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>

#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"
#include "tests/guarded_main.h"
#include "tests/simulation/fleet.h"

namespace {

using legopt::simulation::Fleet;
using legopt::simulation::FleetOptions;
using std::chrono::microseconds;
using Seconds = std::chrono::duration<double>;

double ResidentMegabytes() {
  std::ifstream statm("/proc/self/statm");
  long pages = 0;
  long resident = 0;
  statm >> pages >> resident;
  constexpr double kMegabyte = 1e6;
  return static_cast<double>(resident * sysconf(_SC_PAGESIZE)) / kMegabyte;
}

void Print(const Fleet& fleet) {
  const auto jobs = static_cast<double>(fleet.jobs_done());
  const Seconds cpu = fleet.server_cpu();
  const Seconds elapsed = fleet.elapsed();
  constexpr double kMicroseconds = 1e6;
  constexpr double kPercent = 100;
  std::printf("%9.0f %12.1f %10.0f %14.1f %9.1f %8.1f %8.1f\n", jobs, elapsed.count(), jobs / elapsed.count(),
              kMicroseconds * cpu.count() / jobs, kPercent * cpu.count() / elapsed.count(),
              kPercent * fleet.busy_share(), ResidentMegabytes());
  std::fflush(stdout);
}

int Run(const FleetOptions& options) {
  spdlog::set_level(spdlog::level::off);
  const legopt::db::TemporaryFolder folder;
  const auto store = legopt::db::OpenSqliteStore(folder / "fleet.sqlite");
  Fleet fleet(options, *store);
  std::printf("%d workers of %d slot(s), %lld jobs, RSS %.1f MB before they are submitted\n", options.workers,
              options.slots, static_cast<long long>(options.jobs), ResidentMegabytes());
  std::printf("     jobs  virtual [s]  results/s  CPU/result[us]  core [%%]  busy [%%]  RSS [MB]\n");
  int looks = 0;
  constexpr int kEvery = 5;
  const bool done = fleet.Run([&] {
    if (++looks == 1 || looks % kEvery == 0) Print(fleet);
  });
  return done ? 0 : 1;
}

void PrintLife(const char* what, const Fleet& fleet, microseconds since, std::chrono::nanoseconds cpu) {
  const legopt::bus::Counters& counters = fleet.server_counters();
  const auto received = static_cast<double>(counters.datagrams_received);
  std::printf("%-10s %11.2f %11.2f %11llu %11llu %15.1f %8.1f\n", what, Seconds(fleet.now() - since).count(),
              Seconds(cpu).count(), static_cast<unsigned long long>(counters.datagrams_received),
              static_cast<unsigned long long>(counters.kernel_drops), 1e6 * Seconds(cpu).count() / received,
              ResidentMegabytes());
  std::fflush(stdout);
}

// Measures three phases: all workers say hello at once, registration after an outage, and an idle period.
int RunRestart(const FleetOptions& options) {
  spdlog::set_level(spdlog::level::off);
  constexpr microseconds kLimit = std::chrono::seconds(60);
  const legopt::db::TemporaryFolder folder;
  const auto store = legopt::db::OpenSqliteStore(folder / "fleet.sqlite");
  Fleet fleet(options, *store);
  std::printf("%d workers%s, %lld us per datagram, a receive buffer of %zu datagrams, RSS %.1f MB\n", options.workers,
              options.keyed ? " with a key" : "", static_cast<long long>(options.time_per_datagram.count()),
              options.receive_buffer, ResidentMegabytes());
  std::printf("           virtual [s]     CPU [s]    received        lost  CPU/datagram[us] RSS [MB]\n");
  if (!fleet.RunUntilRegistered(kLimit)) return 1;
  PrintLife("all start", fleet, microseconds(0), fleet.server_cpu());
  fleet.StopServer();
  fleet.RunFor(std::chrono::seconds(3));
  const microseconds back_at = fleet.now();
  const auto cpu_before = fleet.server_cpu();
  fleet.StartServer();
  if (!fleet.RunUntilRegistered(kLimit)) return 1;
  PrintLife("restart", fleet, back_at, fleet.server_cpu() - cpu_before);
  const auto cpu_idle = fleet.server_cpu();
  const microseconds idle_from = fleet.now();
  fleet.RunFor(std::chrono::seconds(5));
  PrintLife("idle 5 s", fleet, idle_from, fleet.server_cpu() - cpu_idle);
  return 0;
}

int Main(int argc, char** argv) {
  FleetOptions options;
  bool restart = false;
  std::int64_t datagram_us = 25;
  std::int64_t job_ms = options.job_time / std::chrono::milliseconds(1);
  CLI::App app{"Load of a server with a large fleet"};
  app.add_option("--workers", options.workers)->capture_default_str();
  app.add_option("--slots", options.slots, "Of each worker")->capture_default_str();
  app.add_option("--jobs", options.jobs)->capture_default_str();
  app.add_option("--experiments", options.experiments, "Among which the jobs are divided")->capture_default_str();
  app.add_option("--job-ms", job_ms, "Duration of a job")->capture_default_str();
  app.add_flag("--keyed", options.keyed, "The deployment has a key");
  const auto is_restart = app.add_flag("--restart", restart, "Instead of jobs: a restart of the server");
  app.add_option("--datagram-us", datagram_us, "Processing time of the server per datagram")
      ->needs(is_restart)
      ->capture_default_str();
  app.add_option("--buffer", options.receive_buffer, "Datagrams that may wait for a party")->needs(is_restart);
  CLI11_PARSE(app, argc, argv);
  options.job_time = std::chrono::milliseconds(job_ms);
  if (!restart) return Run(options);
  options.time_per_datagram = microseconds(datagram_us);
  return RunRestart(options);
}

}  // namespace

int main(int argc, char** argv) { return legopt::GuardedMain(argc, argv, Main); }
