#pragma once

#include <string>

#include "client/plot/plot.h"

namespace legopt::client {

/// Maximum number of panels in an SVG file.
inline constexpr std::size_t kMaxPanels = 24;

/// Renders the figure as an SVG file on white: two panels side by side, the legend and the caption below; 720 pt wide.
/// Colours are those of Okabe and Ito (2008); curves also differ in dash or shape. Text stays text. Throws ClientError
/// (kUsage) for more than kMaxPanels panels.
std::string RenderPlotSvg(const Plot& plot);

}  // namespace legopt::client
