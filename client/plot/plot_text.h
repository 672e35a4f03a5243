#pragma once

#include <string>

#include "client/plot/plot.h"
#include "client/report/text_layout.h"

namespace legopt::client {

/// The figure in ASCII: a panel below the other, each with its legend. A step curve is drawn in the letter of its
/// series; where several meet their letters take turns, so none is hidden. Of points a cell shows how many there are:
/// "o" for one, digits, "#" for ten and more; what is infinite stands beyond the bar of its axis. No line exceeds the
/// layout's width (default: 80; of 40 at least), but for titles and notes nothing is wider than 100.
std::string RenderPlotText(const Plot& plot, const TextLayout& layout = {});

}  // namespace legopt::client
