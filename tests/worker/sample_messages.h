#pragma once

#include <cstdint>
#include <string>

#include "legopt_msg/lease.hpp"
#include "worker/job_executor.h"

namespace legopt::worker {

/// Returns 64 times the same hexadecimal digit.
inline std::string HexHash(char digit) { return std::string(64, digit); }

/// Returns a legal lease of 10 s on dataset HexHash('d') with method HexHash('e').
inline legopt_msg::lease SampleLease(std::int64_t job_id) {
  legopt_msg::lease lease{};
  lease.job_id = job_id;
  lease.experiment_id = 1;
  lease.attempt = 1;
  lease.token = 1000 + job_id;
  lease.lease_us = 10'000'000;
  lease.dataset_hash = HexHash('d');
  lease.method_hash = HexHash('e');
  lease.task = "posture";
  lease.initialization = "good";
  lease.problem_id = static_cast<std::int32_t>(job_id);
  lease.experiment_seed = 1;
  lease.wall_limit_us = 60'000'000;
  lease.memory_limit_bytes = 0;
  return lease;
}

}  // namespace legopt::worker
