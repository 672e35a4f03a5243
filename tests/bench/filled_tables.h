#pragma once

#include <cstdint>
#include <filesystem>

namespace legopt::db {

/// Problems of each task in an experiment of a million results.
inline constexpr int kProblemsOfAMillion = 15'625;

/// Returns the number of results of an experiment: 16 methods x 2 tasks x 2 initial guesses x `problems`.
constexpr std::int64_t JobsOf(int problems) { return std::int64_t{64} * problems; }

/// Fills an empty legopt database with experiments. All jobs are done by 100 workers and nine in ten are solved.
/// Solutions are omitted, since no table reads them.
void FillTables(const std::filesystem::path& file, int experiments, int problems = kProblemsOfAMillion);

}  // namespace legopt::db
