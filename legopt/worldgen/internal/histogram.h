#pragma once

#include <span>
#include <string>
#include <vector>

namespace legopt::worldgen {

/// Numbers of values in bins of equal width.
struct Histogram {
  std::string title;        ///< e.g. "stance length"
  std::string unit;         ///< e.g. "m"; may be empty
  double low = 0.0;         ///< lower end of the first bin
  double width = 1.0;       ///< width of a bin
  std::vector<int> counts;  ///< number of values per bin, from the lowest bin
};

/// Computes about `bins` bins with round limits that cover all (finite) values; no bins without values.
Histogram MakeHistogram(std::string title, std::string unit, std::span<const double> values, int bins = 10);

/// Formats a histogram for a terminal, one line per bin:
///
///     stance length [m], n = 50
///       0.20 ..  0.30 |  5 #####
std::string FormatHistogram(const Histogram& histogram);

/// A row of histograms with a heading.
struct HistogramRow {
  std::string heading;
  std::vector<Histogram> histograms;  ///< left to right
};
/// Formats an SVG picture with one line of histograms per element of `rows`.
std::string FormatHistogramsAsSvg(std::span<const HistogramRow> rows);

}  // namespace legopt::worldgen
