#pragma once

#include <string>

#include "client/plot/plot.h"
#include "client/report/text_layout.h"

namespace legopt::client {

/// Renders the figure in ASCII, panels one below the other, each with a legend. A step curve is drawn with the letter
/// of its series; where curves overlap, their letters alternate so that none is hidden. A cell of a point panel shows
/// the number of points: "o" for one, digits, "#" for ten and more; infinite values are beyond the bar of their axis.
/// Lines are limited to the layout's width (default: 80; clamped to 40 .. 100), except titles and notes.
std::string RenderPlotText(const Plot& plot, const TextLayout& layout = {});

}  // namespace legopt::client
