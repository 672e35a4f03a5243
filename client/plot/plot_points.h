#pragma once

#include "client/plot/plot.h"
#include "client/report/listing.h"

namespace legopt::client {

/// Returns the data of a figure, one row per point: panel, curve, x, y, low, high, quartile_low, quartile_high. `low`
/// and `high` bound the band of a curve or the whiskers of a box, whose median is `y`; in rows without a curve they are
/// the ends of a bar over ranks. Infinite values are null.
Listing PointsOf(const Plot& plot);

}  // namespace legopt::client
