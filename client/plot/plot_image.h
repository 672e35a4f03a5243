#pragma once

#include <string>

#include "client/plot/plot.h"

namespace legopt::client {

enum class ImageFormat { kSvg, kPng };

/// Maximum number of panels in an image.
inline constexpr std::size_t kMaxPanels = 24;

/// Renders the figure on white: two panels side by side, the legend and the caption below; 720 pt wide, PNG at 144
/// points per inch. Colours are those of Okabe and Ito (2008); curves also differ in dash or shape. Throws ClientError:
/// kUsage for more than kMaxPanels panels, kMachine if cairo cannot draw.
std::string RenderPlotImage(const Plot& plot, ImageFormat format);

}  // namespace legopt::client
