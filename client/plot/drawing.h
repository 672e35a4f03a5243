#pragma once

#include <optional>
#include <string>

#include "client/plot/plot.h"

namespace legopt::client {

/// File formats of figures.
enum class PlotFormat {
  kSvg,
  kPdf,
  kPgf  ///< a picture of LaTeX's package tikz
};

/// Size of a figure, in points of 1/72 inch.
struct FigureStyle {
  std::optional<double> width;   ///< default: 80 font sizes, or 40 for one panel
  std::optional<double> height;  ///< default: the height that the panels need
  double font_size = kUsualFontSize_pt;
};

/// Maximum number of panels in a file.
inline constexpr std::size_t kMaxPanels = 24;

/// Renders the figure as a file: panels in one or two columns, as many as the width allows, then the legend and the
/// caption. Colours are those of Okabe and Ito (2008); curves also differ in dash or shape. Throws ClientError: kUsage
/// for more than kMaxPanels panels and for sizes that leave no space for the planes; kMachine if a PDF file cannot be
/// made.
std::string RenderFigure(const Plot& plot, PlotFormat format, const FigureStyle& style = {});

}  // namespace legopt::client
