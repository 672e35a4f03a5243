#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "client/client_error.h"
#include "client/service/child_process.h"
#include "client/service/server_connection.h"
#include "tests/figures/figures.h"
#include "tests/figures/process_facts.h"
#include "tests/service/deployment.h"
#include "tests/temporary_folder.h"

namespace legopt::figures {
namespace {

using client::ChildProcess;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kEightHours_min = 480;
constexpr milliseconds kStart = seconds(20);
constexpr int kWork_ms = 100;
constexpr int kSoakWorkers = 2;
constexpr seconds kRound{10};
constexpr int kJobsPerRound = 100;  // 10 s of work for 20 s of slots
constexpr std::size_t kFewSamples = 4;

// A program whose log is written to a file, so that every line can be read at the end.
class Logged {
 public:
  Logged(const std::string& program, const std::vector<std::string>& arguments, std::filesystem::path log)
      : log_(std::move(log)) {
    std::vector<std::string> words = {"-c", "exec \"$0\" \"$@\" 2>>'" + log_.string() + "'",
                                      service::Program(program).string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    process_ = std::make_unique<ChildProcess>("/bin/sh", words, false);
  }
  ChildProcess& process() { return *process_; }
  std::vector<std::string> Lines() const {
    std::ifstream file(log_);
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
  }

 private:
  std::filesystem::path log_;
  std::unique_ptr<ChildProcess> process_;
};

struct Watched {
  std::string name;
  std::unique_ptr<Logged> program;
  std::vector<ProcessFacts> samples;
  std::vector<double> at_h;
};

// Returns the slope of a least-squares line through memory over time, in per cent of its mean per hour.
double GrowthPerHour(const Watched& watched, std::size_t first) {
  double n = 0, t = 0, m = 0, tt = 0, tm = 0;
  for (std::size_t i = first; i < watched.samples.size(); ++i) {
    const double x = watched.at_h[i];
    const double y = watched.samples[i].resident_mb;
    n += 1, t += x, m += y, tt += x * x, tm += x * y;
  }
  const double spread = n * tt - t * t;
  return spread <= 0 || m <= 0 ? 0 : 100 * ((n * tm - t * m) / spread) / (m / n);
}

// Returns whether a warning is expected once at a start without key or with a small buffer.
bool Explained(const std::string& line) {
  return line.find("no key:") != std::string::npos || line.find("receive buffer of") != std::string::npos;
}

class Soak {
 public:
  explicit Soak(std::uint64_t seed) {
    setenv("LEGOPT_DEPLOYMENT", std::to_string(seed + 1'000'000).c_str(), 1);
    const int near = bus::FindFreePortPair(bus::RandomSeed());
    do far_ = bus::FindFreePortPair(bus::RandomSeed());
    while (std::abs(far_ - near) < 2);
    relay_ = std::make_unique<ChildProcess>(
        service::Program("injuring_relay"),
        std::vector<std::string>{"--near", std::to_string(near), "--far", std::to_string(far_), "--seed",
                                 std::to_string(seed), "--drop", "0.05", "--duplicate", "0", "--reorder", "0",
                                 "--max-delay-ms", "1"},
        true);
    if (!relay_->WaitForLine("ready", kStart)) throw std::runtime_error(relay_->ErrorTail());
    Add("server", "legopt-server", {"--db", (folder_ / "soak.sqlite").string(), "--port", std::to_string(near)});
    if (!watched_[0].program->process().WaitForLine("ready", kStart)) throw std::runtime_error("no server");
    for (int i = 1; i <= kSoakWorkers; ++i) {
      Add("worker " + std::to_string(i), "stub_worker",
          {"--slots", "1", "--dataset", "stub-d", "--port", std::to_string(far_)});
    }
  }
  Soak(const Soak&) = delete;
  Soak& operator=(const Soak&) = delete;

  void Run(double minutes, Findings& findings) {
    client::NetworkOptions network;
    network.port = far_;
    client::ServerConnection client(network);
    const auto begin = Clock::now();
    std::int64_t last = 0;
    for (auto next = begin; SecondsSince(begin) < minutes * 60; next += kRound) {
      std::this_thread::sleep_until(next);
      last = Submit(client);
      for (Watched& each : watched_) {
        each.samples.push_back(FactsOf(each.program->process().pid()));
        each.at_h.push_back(SecondsSince(begin) / 3600);
      }
    }
    const bool done = WaitUntil([&] { return Over(client, last); }, seconds(60));
    findings.Promise(done, std::to_string(submitted_ * kJobsPerRound) + " jobs in " + std::to_string(submitted_) +
                               " experiments submitted, the last one done");
  }

  void Judge(Findings& findings) const {
    for (const Watched& each : watched_) {
      const std::size_t warm = each.samples.size() / 3;
      if (each.samples.size() - warm < kFewSamples) {
        findings.Note(each.name + ": too short to say more");
        continue;
      }
      const auto [few, many] = Extremes(each, warm, &ProcessFacts::descriptors);
      findings.Promise(many - few <= 1, each.name + ": " + std::to_string(few) + " .. " + std::to_string(many) +
                                            " descriptors after warm-up");
      const auto [least, most] = Extremes(each, warm, &ProcessFacts::threads);
      findings.Promise(most == least,
                       each.name + ": " + std::to_string(least) + " .. " + std::to_string(most) + " threads");
      findings.Note(each.name + ": " + std::to_string(each.samples[warm].resident_mb) + " MB after warm-up, " +
                    std::to_string(each.samples.back().resident_mb) + " MB at the end");
      findings.Quantity(each.name + ": memory grows by", GrowthPerHour(each, warm), 1, "% of itself per hour");
      int odd = 0;
      for (const std::string& line : each.program->Lines()) {
        const bool complaint = line.find("warn") != std::string::npos || line.find("error") != std::string::npos;
        if (!complaint || Explained(line)) continue;
        ++odd;
        findings.Note(each.name + " says: " + line);
      }
      findings.Promise(odd == 0, each.name + ": " + std::to_string(odd) + " unexplained lines at warning");
    }
  }

 private:
  void Add(const std::string& name, const std::string& program, const std::vector<std::string>& arguments) {
    watched_.push_back({name, std::make_unique<Logged>(program, arguments, folder_ / (name + ".log")), {}, {}});
  }
  static std::pair<int, int> Extremes(const Watched& watched, std::size_t first, int ProcessFacts::*fact) {
    std::vector<int> values;
    for (std::size_t i = first; i < watched.samples.size(); ++i) values.push_back(watched.samples[i].*fact);
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    return {*least, *most};
  }
  std::int64_t Submit(client::ServerConnection& client) {
    const std::string id = "round " + std::to_string(submitted_);
    for (;;) {
      try {
        const auto reply = client.Submit(id, service::StubSpec(kJobsPerRound, kWork_ms).dump());
        ++submitted_;
        return reply.experiment_id;
      } catch (const client::ClientError&) {
        // Lost in transit; the same id is the same experiment.
      }
    }
  }
  static bool Over(client::ServerConnection& client, std::int64_t experiment) {
    try {
      return client.Status(experiment).at("experiments").at(0).at("state") == "done";
    } catch (const client::ClientError&) {
      return false;
    }
  }

  test::TemporaryFolder folder_;
  int far_ = 0;
  int submitted_ = 0;
  std::unique_ptr<ChildProcess> relay_;
  std::vector<Watched> watched_;
};

}  // namespace

void MeasureSoak(const Request& request, Findings& findings) {
  findings.Begin("27");
  Soak soak(request.seed);
  soak.Run(request.minutes > 0 ? request.minutes : kEightHours_min, findings);
  soak.Judge(findings);
}

}  // namespace legopt::figures
