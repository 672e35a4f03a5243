#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "client/page/page_figures.h"

namespace legopt::client {

/// Arguments of `legopt report`.
struct ReportRequest : FigureRequest {
  std::size_t most_bytes = 25'000'000;  ///< size limit of the file; solutions beyond it are omitted with a note
};

/// A page with notes for its reader and its author.
struct Page {
  std::string text;                ///< contents of the file
  std::vector<std::string> notes;  ///< omitted, unfinished or disturbed parts
};

/// Reads, computes and judges all contents of the page. Throws the errors of ReadBenchmarkTable and DescribeDataset.
Page MakeReport(const ReportRequest& request);

}  // namespace legopt::client
