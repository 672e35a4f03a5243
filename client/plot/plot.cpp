#include "client/plot/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr double kTen = 10.0, kTiny = 1e-9;

PlotTick TickAt(double value) { return {value, FormatGeneral(value)}; }

bool Within(const PlotAxis& axis, double value) {
  const double slack = kTiny * std::max(std::abs(axis.from), std::abs(axis.to));
  return value >= axis.from - slack && value <= axis.to + slack;
}

std::vector<PlotTick> Multiples(const PlotAxis& axis, double step) {
  std::vector<PlotTick> ticks;
  const auto first = static_cast<long>(std::ceil(axis.from / step - kTiny));
  for (long i = first; Within(axis, static_cast<double>(i) * step); ++i) {
    ticks.push_back(TickAt(static_cast<double>(i) * step));
  }
  return ticks;
}

std::vector<PlotTick> LinearTicks(const PlotAxis& axis, int most) {
  const double power = std::pow(kTen, std::floor(std::log10((axis.to - axis.from) / most)));
  for (const double factor : {1.0, 2.0, 5.0, 10.0}) {
    auto ticks = Multiples(axis, factor * power);
    if (ticks.size() <= static_cast<std::size_t>(most)) return ticks;
  }
  return Multiples(axis, 2.0 * kTen * power);
}

// Returns every `stride`-th power of ten, multiplied by each factor.
template <std::size_t kCount>
std::vector<PlotTick> Powers(const PlotAxis& axis, int stride, const std::array<double, kCount>& factors) {
  std::vector<PlotTick> ticks;
  const int first = static_cast<int>(std::floor(std::log10(axis.from))), last = static_cast<int>(std::log10(axis.to));
  for (int power = first; power <= last + 1; ++power) {
    if (power % stride != 0) continue;
    for (const double factor : factors) {
      const double value = factor * std::pow(kTen, power);
      if (Within(axis, value)) ticks.push_back(TickAt(value));
    }
  }
  return ticks;
}

std::vector<PlotTick> LogarithmicTicks(const PlotAxis& axis, int most) {
  constexpr std::size_t kFewest = 2;
  const auto fits = [&](const auto& ticks) {
    return ticks.size() >= kFewest && ticks.size() <= static_cast<std::size_t>(most);
  };
  auto ticks = Powers(axis, 1, std::array{1.0, 2.0, 5.0});
  if (fits(ticks)) return ticks;
  if (ticks.size() < kFewest) return LinearTicks(axis, most);
  for (int stride = 1; !ticks.empty(); ++stride) {
    ticks = Powers(axis, stride, std::array{1.0});
    if (ticks.size() <= static_cast<std::size_t>(most)) return ticks;
  }
  return ticks;
}

}  // namespace

double PlaceOn(const PlotAxis& axis, double value) {
  if (axis.logarithmic) {
    if (std::isinf(value)) return 1.0;
    const double least = std::max(value, axis.from);
    return std::clamp(std::log(least / axis.from) / std::log(axis.to / axis.from), 0.0, 1.0);
  }
  if (std::isinf(value)) return value > 0.0 ? 1.0 : 0.0;
  return std::clamp((value - axis.from) / (axis.to - axis.from), 0.0, 1.0);
}

std::vector<PlotTick> TicksOf(const PlotAxis& axis, int most) {
  return axis.logarithmic ? LogarithmicTicks(axis, most) : LinearTicks(axis, most);
}

namespace {

constexpr std::size_t kDefaultWidth = 80, kMinWidth = 40, kMaxWidth = 100;
constexpr std::size_t kRows = 16, kRimColumns = 3, kLabelColumns = 7;
constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";

char LetterOf(std::size_t entry) { return kLetters[entry % kLetters.size()]; }

// The plane of one panel, rows from top to bottom: a row for the rim and its bar (if any), then the cells of the axes.
class TextPlane {
 public:
  TextPlane(const PlotPanel& panel, std::size_t width)
      : panel_(panel),
        top_(panel.y.rim ? 2 : 0),
        columns_(width - kLabelColumns - 1 - (panel.x.rim ? kRimColumns : 0)),
        rows_(top_ + kRows, std::string(width - kLabelColumns - 1, ' ')) {
    if (panel.y.rim) rows_[1].assign(rows_[1].size(), '-');
    if (!panel.x.rim) return;
    for (std::string& row : rows_) row[columns_ + 1] = '|';
  }

  std::size_t columns() const { return columns_; }
  std::size_t RowOf(double y) const {
    if (std::isinf(y)) return 0;
    return top_ + kRows - 1 - At(panel_.y, y, kRows);
  }
  std::size_t ColumnOf(double x) const {
    return std::isinf(x) ? columns_ + kRimColumns - 1 : At(panel_.x, x, columns_);
  }
  char& At(std::size_t row, std::size_t column) { return rows_[row][column]; }
  const std::vector<std::string>& rows() const { return rows_; }

 private:
  static std::size_t At(const PlotAxis& axis, double value, std::size_t cells) {
    return static_cast<std::size_t>(std::lround(PlaceOn(axis, value) * static_cast<double>(cells - 1)));
  }

  const PlotPanel& panel_;
  std::size_t top_, columns_;
  std::vector<std::string> rows_;
};

// Returns the value of a step curve at each column: the value of the last step up to that column.
std::vector<double> Sampled(const PlotSeries& series, const TextPlane& plane) {
  std::vector<double> values(plane.columns(), 0.0);
  for (const PlotPoint& step : series.points) {
    for (std::size_t column = plane.ColumnOf(step.x); column < values.size(); ++column) values[column] = step.y;
  }
  return values;
}

void DrawSteps(const PlotPanel& panel, TextPlane* plane) {
  std::vector<std::vector<std::size_t>> rows;  // row of each series at each column
  for (const PlotSeries& series : panel.series) {
    auto& places = rows.emplace_back();
    for (const double value : Sampled(series, *plane)) places.push_back(plane->RowOf(value));
  }
  for (std::size_t column = 0; column < plane->columns(); ++column) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      std::vector<std::size_t> meeting;
      for (std::size_t other = 0; other < rows.size(); ++other) {
        if (rows[other][column] == rows[i][column]) meeting.push_back(other);
      }
      const PlotSeries& shown = panel.series[meeting[column % meeting.size()]];
      plane->At(rows[i][column], column) = LetterOf(shown.entry);
    }
  }
}

void DrawPoints(const PlotPanel& panel, TextPlane* plane) {
  for (std::size_t column = 0; column < plane->columns(); ++column) {
    const double share = static_cast<double>(column) / static_cast<double>(plane->columns() - 1);
    const double x = panel.x.logarithmic ? panel.x.from * std::pow(panel.x.to / panel.x.from, share)
                                         : panel.x.from + share * (panel.x.to - panel.x.from);
    if (x >= panel.y.from && x <= panel.y.to) plane->At(plane->RowOf(x), column) = '.';
  }
  std::vector<std::vector<int>> counts(plane->rows().size(), std::vector<int>(plane->rows().front().size()));
  for (const PlotSeries& series : panel.series) {
    for (const PlotPoint& point : series.points) ++counts[plane->RowOf(point.y)][plane->ColumnOf(point.x)];
  }
  for (std::size_t row = 0; row < counts.size(); ++row) {
    for (std::size_t column = 0; column < counts[row].size(); ++column) {
      const int count = counts[row][column];
      if (count == 0) continue;
      constexpr int kMany = 10;
      plane->At(row, column) = count == 1 ? 'o' : count < kMany ? static_cast<char>('0' + count) : '#';
    }
  }
}

std::string Aligned(const std::string& text, std::size_t width) {
  return text.size() >= width ? text : std::string(width - text.size(), ' ') + text;
}

// Returns the labels of the rows; empty for rows without a tick.
std::vector<std::string> RowLabels(const PlotPanel& panel, const TextPlane& plane) {
  constexpr int kMost = 6;
  std::vector<std::string> labels(plane.rows().size());
  for (const PlotTick& tick : TicksOf(panel.y, kMost)) labels[plane.RowOf(tick.value)] = tick.label;
  if (panel.y.rim) labels[0] = "failed";
  return labels;
}

// Returns the marks of the x axis, and their labels below.
std::string ColumnAxis(const PlotPanel& panel, const TextPlane& plane) {
  constexpr std::size_t kPerLabel = 9;
  std::string marks(plane.rows().front().size(), '-'), labels(marks.size() + kPerLabel, ' ');
  const auto put = [&](std::size_t column, const std::string& label) {
    const std::size_t from = column >= label.size() / 2 ? column - label.size() / 2 : 0;
    const bool free = labels.substr(from, label.size() + 1).find_first_not_of(' ') == std::string::npos &&
                      (from == 0 || labels[from - 1] == ' ');
    if (free) labels.replace(from, label.size(), label);
  };
  if (panel.x.rim) {
    const std::string failed = "failed";
    put(marks.size() - failed.size() / 2, failed);
  }
  const int most = std::max(2, static_cast<int>(plane.columns() / kPerLabel));
  for (const PlotTick& tick : TicksOf(panel.x, most)) {
    marks[plane.ColumnOf(tick.value)] = '+';
    put(plane.ColumnOf(tick.value), tick.label);
  }
  labels.erase(labels.find_last_not_of(' ') + 1);
  const std::string margin(kLabelColumns, ' ');
  return margin + "+" + marks + "\n" + margin + " " + labels + "\n";
}

std::string Legend(const Plot& plot, const PlotPanel& panel, const TextLayout& layout) {
  std::string text;
  for (const PlotSeries& series : panel.series) {
    if (panel.kind != PlotKind::kSteps) continue;
    text += Paragraph(
        std::string("  ") + LetterOf(series.entry) + "  " + plot.entries[series.entry] + ": " + series.note, layout);
  }
  for (const std::string& note : panel.notes) text += Paragraph(note, layout, Emphasis::kDim);
  return text;
}

std::string PanelText(const Plot& plot, const PlotPanel& panel, const TextLayout& layout) {
  const std::size_t asked = layout.width == 0 ? kDefaultWidth : layout.width;
  // The labels of the x axis may extend three columns beyond the plane.
  constexpr std::size_t kBeyond = 3;
  TextPlane plane(panel, std::clamp(asked, kMinWidth, kMaxWidth) - kBeyond);
  if (panel.kind == PlotKind::kSteps) {
    DrawSteps(panel, &plane);
  } else {
    DrawPoints(panel, &plane);
  }
  std::string text = Paragraph(panel.title, layout, Emphasis::kBest) + Paragraph("y: " + panel.y.title, layout);
  const auto labels = RowLabels(panel, plane);
  for (std::size_t row = 0; row < labels.size(); ++row) {
    std::string line = Aligned(labels[row] + " ", kLabelColumns) + "|" + plane.rows()[row];
    text += line.erase(line.find_last_not_of(' ') + 1) + "\n";
  }
  text += ColumnAxis(panel, plane) + Paragraph("x: " + panel.x.title, layout);
  return text + Legend(plot, panel, layout);
}

}  // namespace

std::string RenderPlotText(const Plot& plot, const TextLayout& layout) {
  std::string text;
  for (const PlotPanel& panel : plot.panels) text += PanelText(plot, panel, layout) + "\n";
  return text + Paragraph(plot.caption, layout, Emphasis::kDim);
}

}  // namespace legopt::client
