#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/benchmark_table.h"
#include "client/result_source.h"

namespace legopt::client {

/// The benchmark table of an experiment (the newest one without `id`) under `rule`. Errors as of FindExperiment.
BenchmarkTable ReadBenchmarkTable(ResultSource& source, std::optional<std::int64_t> id, const std::string& rule);

}  // namespace legopt::client
