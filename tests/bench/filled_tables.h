#pragma once

#include <cstdint>
#include <filesystem>

namespace legopt::db {

inline constexpr std::int64_t kResultsPerExperiment = 1'000'000;

/// Fills an empty legopt database with experiments of the maximum size: 16 methods x 2 tasks x 2 initial guesses x
/// 15,625 problems. All jobs are done by 100 workers and nine in ten are solved. Solutions are omitted, since no table
/// reads them.
void FillTables(const std::filesystem::path& file, int experiments);

}  // namespace legopt::db
