// Acceptance figures (docs/explanation/reliability.md#the-figures) that need real processes, real time or a real file.
// Each function starts its own deployment, prints its measurements and judges them.
#pragma once

#include <cstdint>
#include <filesystem>

#include "tests/figures/findings.h"

namespace legopt::figures {

struct Request {
  int count = 0;       ///< trials, rows, packets or problems, depending on the figure; 0: the defaults below
  double minutes = 0;  ///< duration of readers, throughput and soak; 0: the defaults below
  std::uint64_t seed = 1;
  std::filesystem::path dataset;  ///< dataset of determinism
};

/// Figure 2: `count` (500) SIGKILLs of the server while clients submit; every acknowledged experiment exists exactly
/// once.
void MeasureDurability(const Request& request, Findings& findings);
/// Figure 8: the slot of a job process that dies of SIGSEGV is available again within 2 s. `count` deaths (20),
/// released worker.
void MeasureSlotReturn(const Request& request, Findings& findings);
/// Figure 9: an endless job ends within its limit + 1 s, and no job process outlives its killed supervisor by 1 s.
/// `count` (20).
void MeasureLimits(const Request& request, Findings& findings);
/// Figure 14: `count` (1,000,000) hostile packets at 5,000/s during 200 jobs.
void MeasureHostility(const Request& request, Findings& findings);
/// Figures 17, 20: ready within 2 s with `count` (100,000) result rows, also after SIGKILL; backup and restore of that
/// file.
void MeasureLargeFile(const Request& request, Findings& findings);
/// Figure 19: lease latency during a read of `minutes` (1), a backup and an export of `count` (100,000) rows.
void MeasureReaders(const Request& request, Findings& findings);
/// Figure 23: every solver on `count` (50) problems of `dataset`, idle, under load, and with killed workers; then
/// replays 100 rows.
void MeasureDeterminism(const Request& request, Findings& findings);
/// Figure 24: `count` (10,000) jobs that take no time; then, for `minutes` (1), the cost of messages of a busy worker.
void MeasureThroughput(const Request& request, Findings& findings);
/// Figure 25: a program that cannot start reports this within a second, with its exit code.
void MeasureStartUp(const Request& request, Findings& findings);
/// Figure 28: 200 streams, slow and hostile readers of `legopt serve`, and `count` (20,000) requests, with a busy
/// server.
void MeasurePageReaders(const Request& request, Findings& findings);
/// Figure 27: half load under 5 % loss for `minutes` (480): descriptors, threads, memory, log.
void MeasureSoak(const Request& request, Findings& findings);

}  // namespace legopt::figures
