#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "client/page/page_figures.h"

namespace legopt::client {

/// What `legopt report` is asked for.
struct ReportRequest : FigureRequest {
  std::size_t most_bytes = 25'000'000;  ///< of the file; what would go beyond is left out, and said
};

/// A page, and what its reader and its writer should know of it.
struct Page {
  std::string text;                ///< of the file
  std::vector<std::string> notes;  ///< what is left out, unfinished, contended
};

/// Reads, computes and judges all that the page shows. Errors as of ReadBenchmarkTable and DescribeDataset.
Page MakeReport(const ReportRequest& request);

}  // namespace legopt::client
