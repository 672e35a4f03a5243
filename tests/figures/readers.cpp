#include <algorithm>
#include <array>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include "client/service/child_process.h"
#include "db/connection.h"
#include "db/read_only_database.h"
#include "tests/figures/figures.h"
#include "tests/figures/filled_database.h"
#include "tests/figures/lease_prober.h"

namespace legopt::figures {
namespace {

using service::Deployment;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kRows = 100'000;
constexpr int kOpenJobs = 60'000;  // more than can be done in that time
constexpr double kLimit_ms = 100;
constexpr double kLimit_mb = 64;
constexpr double kMebibyte = 1 << 20;

// Records sizes of the write-ahead log during an operation.
class LogWatch {
 public:
  explicit LogWatch(std::filesystem::path log)
      : log_(std::move(log)), watcher_([this] {
          while (!stop_) {
            largest_mb_ = std::max(largest_mb_, Size_mb());
            std::this_thread::sleep_for(milliseconds(50));
          }
        }) {}
  ~LogWatch() { Stop(); }
  LogWatch(const LogWatch&) = delete;
  LogWatch& operator=(const LogWatch&) = delete;
  void Stop() {
    stop_ = true;
    if (watcher_.joinable()) watcher_.join();
  }
  double largest_mb() const { return largest_mb_; }  ///< after Stop
  // Returns how often the log was restarted, which requires a complete checkpoint (SQLite's file format, section 4.1:
  // bytes 12 .. 15 of the log).
  std::uint32_t Restarts() const {
    constexpr int kOffset = 12;
    std::ifstream file(log_, std::ios::binary);
    file.seekg(kOffset);
    std::array<char, 4> bytes{};
    file.read(bytes.data(), bytes.size());
    std::uint32_t number = 0;
    for (const char byte : bytes) number = (number << 8U) | static_cast<unsigned char>(byte);
    return number;
  }
  double Size_mb() const {
    std::error_code missing;
    const auto bytes = std::filesystem::file_size(log_, missing);
    return missing ? 0 : static_cast<double>(bytes) / kMebibyte;
  }

 private:
  std::filesystem::path log_;
  std::atomic<bool> stop_{false};
  double largest_mb_ = 0;
  std::thread watcher_;
};

// Holds a read transaction for `duration`, which delays the checkpoint.
void LongRead(const std::filesystem::path& file, double duration_s) {
  const auto connection = db::OpenForReading(file);
  connection->Execute("BEGIN");
  db::Statement count(*connection, "SELECT count(*) FROM results");
  count.Step();
  const std::int64_t before = count.column_int(0);
  const auto begin = Clock::now();
  while (SecondsSince(begin) < duration_s) {
    count.Reset();
    count.Step();
    if (count.column_int(0) != before) throw std::runtime_error("a read transaction saw two states");
    std::this_thread::sleep_for(seconds(1));
  }
  count.Reset();
  connection->Execute("COMMIT");
}

bool RunClient(const std::vector<std::string>& arguments) {
  client::ChildProcess program(service::Program("legopt"), arguments, true);
  const auto exit = program.Wait(std::chrono::minutes(10));
  return exit && exit->signal == 0 && exit->code == 0;
}

// Repeats a backup and an export of the whole table during the long read.
void ReadMuch(const Deployment& deployment, double duration_s, Findings& findings) {
  const std::string file = deployment.database().string();
  std::jthread reader([&] { LongRead(file, duration_s); });
  const auto begin = Clock::now();
  int backups = 0;
  int exports = 0;
  bool good = true;
  do {
    const std::string copy = (deployment.folder() / ("copy" + std::to_string(backups++) + ".sqlite")).string();
    good = good && RunClient({"service", "backup", "--db", file, copy});
    std::filesystem::remove(copy);
    ++exports;
    good =
        good && RunClient({"query", "SELECT * FROM results", "--db", file, "--format", "csv", "--max-rows", "1000000"});
  } while (SecondsSince(begin) < duration_s);
  reader.join();
  findings.Promise(good, "a read of " + std::to_string(duration_s) + " s in one transaction, " +
                             std::to_string(backups) + " backups and " + std::to_string(exports) +
                             " exports of every result meanwhile");
}

}  // namespace

void MeasureReaders(const Request& request, Findings& findings) {
  const int rows = request.count > 0 ? request.count : kRows;
  const double duration_s = (request.minutes > 0 ? request.minutes : 1) * 60;
  const auto deployment = FilledDeployment(rows, kOpenJobs);
  deployment->StartServer();
  const auto worker = deployment->StartStubWorker({"--slots", "2"});
  findings.Begin("19");
  LogWatch log(deployment->database().string() + "-wal");
  std::atomic<bool> stop{false};
  LeaseProber prober(deployment->port());
  std::exception_ptr fault;
  std::jthread readers([&] {
    try {
      ReadMuch(*deployment, duration_s, findings);
    } catch (...) {
      fault = std::current_exception();
    }
    stop = true;
  });
  prober.Run(stop);
  readers.join();
  if (fault) std::rethrow_exception(fault);
  log.Stop();
  // Idle moments, in which the server checkpoints, with a write after each.
  worker->Stop(seconds(5));
  const std::uint32_t restarts = log.Restarts();
  int write = 0;
  const auto restarted = [&] {
    deployment->Submit(service::StubSpec(1, 1), "write " + std::to_string(write++));
    std::this_thread::sleep_for(seconds(2));
    return log.Restarts() != restarts;
  };
  const bool reused = WaitUntil(restarted, seconds(60));
  const auto& latencies = prober.latencies_ms();
  findings.Promise(prober.timeouts() == 0 && !latencies.empty(),
                   std::to_string(latencies.size()) + " lease calls, none unanswered");
  findings.Quantity("lease p99", Quantile(latencies, 0.99), kLimit_ms, "ms");
  findings.Quantity("lease median", Quantile(latencies, 0.5), kLimit_ms, "ms");
  findings.Quantity("largest write-ahead log", log.largest_mb(), kLimit_mb, "MiB");
  findings.Promise(reused, "the log begins anew once the readers are gone; " + std::to_string(log.Size_mb()) + " MiB");
}

}  // namespace legopt::figures
