#pragma once

#include <filesystem>
#include <vector>

#include "client/report/benchmark_table.h"

namespace legopt::client {

/// The paper's Table I as data/paper-table1.csv holds it, in the order of its rows. Lines that start with '#' are
/// comments; an empty field is a dash. Throws InputError naming file, line and column.
std::vector<BenchmarkRow> ReadPaperTable(const std::filesystem::path& file);

/// Puts the paper's figures beside every row of the table that has the same method (letter case ignored), multi-starts
/// and sample size.
void AddPaperFigures(const std::vector<BenchmarkRow>& paper, BenchmarkTable* table);

}  // namespace legopt::client
