#include "legopt/worldgen/internal/histogram.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "legopt/types/number_text.h"

namespace legopt::worldgen {
namespace {

/// Returns the smallest 1, 2 or 5 times a power of ten that is at least `least`.
double RoundWidth(double least) {
  const double power = std::pow(10.0, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= least * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

/// Pads a text with blanks on the left to at least `width` characters.
std::string Padded(const std::string& text, std::size_t width) {
  return text.size() < width ? std::string(width - text.size(), ' ') + text : text;
}

std::string FourDigits(double value) { return FormatGeneral(value, 4); }

std::string Heading(const Histogram& histogram) {
  return histogram.title + (histogram.unit.empty() ? "" : " [" + histogram.unit + "]") +
         ", n = " + std::to_string(std::accumulate(histogram.counts.begin(), histogram.counts.end(), 0));
}

constexpr int kPlotWidth = 230;
constexpr int kPlotHeight = 150;
constexpr int kGap = 50;
constexpr int kHead = 60;

void DrawOne(const Histogram& histogram, int x, int y, std::string& svg) {
  const auto line = [&](const std::string& text) { svg += text + "\n"; };
  const auto at = [](double value) { return FormatFixed(value, 1); };
  line("<text x='" + at(x) + "' y='" + at(y - 8) + "'>" + Heading(histogram) + "</text>");
  const int most =
      std::max(1, histogram.counts.empty() ? 1 : *std::max_element(histogram.counts.begin(), histogram.counts.end()));
  const double bar =
      static_cast<double>(kPlotWidth) / static_cast<double>(std::max<size_t>(1, histogram.counts.size()));
  for (size_t k = 0; k < histogram.counts.size(); ++k) {
    const double height = static_cast<double>(kPlotHeight) * histogram.counts[k] / most;
    line("<rect x='" + at(x + bar * static_cast<double>(k) + 1) + "' y='" + at(y + kPlotHeight - height) + "' width='" +
         at(bar - 2) + "' height='" + at(height) + "'/>");
  }
  line("<path d='M" + at(x) + " " + at(y) + "v" + at(kPlotHeight) + "h" + at(kPlotWidth) + "'/>");
  const double high = histogram.low + histogram.width * static_cast<double>(histogram.counts.size());
  line("<text x='" + at(x) + "' y='" + at(y + kPlotHeight + 16) + "'>" + FourDigits(histogram.low) + "</text>");
  line("<text x='" + at(x + kPlotWidth) + "' y='" + at(y + kPlotHeight + 16) + "' text-anchor='end'>" +
       FourDigits(high) + "</text>");
  line("<text x='" + at(x - 4) + "' y='" + at(y + 10) + "' text-anchor='end'>" + std::to_string(most) + "</text>");
}

}  // namespace

Histogram MakeHistogram(std::string title, std::string unit, std::span<const double> values, int bins) {
  Histogram histogram{std::move(title), std::move(unit), 0.0, 1.0, {}};
  if (values.empty()) return histogram;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  constexpr double kMinSpread = 1e-6;
  histogram.width = RoundWidth(std::max(kMinSpread, *most - *least) / bins);
  histogram.low = histogram.width * std::floor(*least / histogram.width + 1e-9);
  const auto bin = [&](double value) {
    return static_cast<size_t>(std::max(0.0, std::floor((value - histogram.low) / histogram.width + 1e-9)));
  };
  histogram.counts.resize(bin(*most) + 1);
  for (const double value : values) ++histogram.counts[bin(value)];
  return histogram;
}

std::string FormatHistogram(const Histogram& histogram) {
  constexpr int kLongest = 50;
  std::string text = Heading(histogram) + "\n";
  if (histogram.counts.empty()) return text;
  const int most = std::max(1, *std::max_element(histogram.counts.begin(), histogram.counts.end()));
  for (size_t k = 0; k < histogram.counts.size(); ++k) {
    const double low = histogram.low + histogram.width * static_cast<double>(k);
    const int count = histogram.counts[k];
    const int length =
        most > kLongest ? static_cast<int>(std::lround(static_cast<double>(count) * kLongest / most)) : count;
    text += "  " + Padded(FourDigits(low), 8) + " .." + " " + Padded(FourDigits(low + histogram.width), 8) + " |" +
            Padded(FormatFixed(count, 0), 5) + " " + std::string(static_cast<size_t>(length), '#') + "\n";
  }
  return text;
}

std::string FormatHistogramsAsSvg(std::span<const HistogramRow> rows) {
  size_t columns = 1;
  for (const HistogramRow& row : rows) columns = std::max(columns, row.histograms.size());
  const int width = kGap + static_cast<int>(columns) * (kPlotWidth + kGap);
  const int height = static_cast<int>(rows.size()) * (kPlotHeight + kHead + kGap) + kGap;
  std::string svg = "<svg xmlns='http://www.w3.org/2000/svg' width='" + std::to_string(width) + "' height='" +
                    std::to_string(height) +
                    "' font-family='sans-serif' font-size='12'>\n"
                    "<style>rect{fill:#4878a8} path{fill:none;stroke:#333}</style>\n"
                    "<path d='M0 0h" +
                    std::to_string(width) + "v" + std::to_string(height) + "H0z' style='fill:#fff;stroke:none'/>\n";
  int y = kHead;
  for (const HistogramRow& row : rows) {
    svg += "<text x='" + std::to_string(kGap) + "' y='" + std::to_string(y - 30) + "' font-weight='bold'>" +
           row.heading + "</text>\n";
    for (size_t k = 0; k < row.histograms.size(); ++k) {
      DrawOne(row.histograms[k], kGap + static_cast<int>(k) * (kPlotWidth + kGap), y, svg);
    }
    y += kPlotHeight + kHead + kGap;
  }
  return svg + "</svg>\n";
}

}  // namespace legopt::worldgen
