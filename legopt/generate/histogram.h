#pragma once

#include <span>
#include <string>
#include <vector>

namespace legopt::generate {

/// Counts of values in bins of equal width.
struct Histogram {
  std::string title;        ///< "stance length"
  std::string unit;         ///< "m"; may be empty
  double low = 0.0;         ///< lower end of the first bin
  double width = 1.0;       ///< of a bin
  std::vector<int> counts;  ///< values in each bin, from the lowest on
};

/// About `bins` bins with round limits that cover all (finite) values; none for no values.
Histogram MakeHistogram(std::string title, std::string unit, std::span<const double> values, int bins = 10);

/// For a terminal, a line per bin:
///
///     stance length [m], n = 50
///       0.20 ..  0.30 |  5 #####
std::string FormatHistogram(const Histogram& histogram);

/// Histograms that stand side by side, with a heading.
struct HistogramRow {
  std::string heading;                ///< of the row
  std::vector<Histogram> histograms;  ///< from left to right
};
/// One SVG picture with a row for each element of `rows`.
std::string FormatHistogramsAsSvg(std::span<const HistogramRow> rows);

}  // namespace legopt::generate
