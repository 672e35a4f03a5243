#pragma once

#include <string>

#include "client/plot/plot.h"

namespace legopt::client {

enum class ImageFormat { kSvg, kPng };

/// The most panels that one image holds.
inline constexpr std::size_t kMostPanels = 24;

/// The figure as bytes of a file, on white, two panels beside each other, the legend and the caption below; 720 pt
/// wide, PNG at 144 points per inch. Colours are those of Okabe and Ito (2008), each with a dash or a shape of its own.
/// Throws ClientError: kUsage for more than kMostPanels panels; kMachine where cairo cannot draw.
std::string RenderPlotImage(const Plot& plot, ImageFormat format);

}  // namespace legopt::client
