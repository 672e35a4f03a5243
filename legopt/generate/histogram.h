#pragma once

#include <span>
#include <string>
#include <vector>

namespace legopt::generate {

/// Counts of values in bins of equal width.
struct Histogram {
  std::string title;   ///< "stance length"
  std::string unit;    ///< "m"; may be empty
  double low = 0.0;    ///< lower end of the first bin
  double width = 1.0;  ///< of a bin
  std::vector<int> counts;
};

/// About `bins` bins with round limits that cover all (finite) values; none for no values.
Histogram MakeHistogram(std::string title, std::string unit, std::span<const double> values, int bins = 10);

/// For a terminal, a line per bin:
///
///     stance length [m], n = 50
///       0.20 ..  0.30 |  5 #####
std::string FormatHistogram(const Histogram& histogram);

/// One SVG picture with the histograms side by side, a row per element of `rows`, with a heading each.
struct HistogramRow {
  std::string heading;
  std::vector<Histogram> histograms;
};
std::string FormatHistogramsAsSvg(std::span<const HistogramRow> rows);

}  // namespace legopt::generate
