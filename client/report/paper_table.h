#pragma once

#include <filesystem>
#include <vector>

#include "client/report/benchmark_table.h"

namespace legopt::client {

/// Reads the paper's Table I from data/paper-table1.csv, in the order of its rows. Lines that start with '#' are
/// comments; an empty field is a dash. Throws InputError with file, line and column.
std::vector<BenchmarkRow> ReadPaperTable(const std::filesystem::path& file);

/// Adds the paper's figures to every row of the table with the same method (ignoring case), multi-starts and sample
/// size.
void AddPaperFigures(const std::vector<BenchmarkRow>& paper, BenchmarkTable* table);

}  // namespace legopt::client
