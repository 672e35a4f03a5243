#pragma once

#include <cstdint>
#include <filesystem>

namespace legopt::db {

inline constexpr std::int64_t kResultsPerExperiment = 1'000'000;

/// Fills an empty legopt database with experiments as large as one may be: 16 methods x 2 tasks x 2 starts x 15,625
/// problems, all done, nine in ten solved, by 100 workers; without the solutions, which no table reads.
void FillTables(const std::filesystem::path& file, int experiments);

}  // namespace legopt::db
