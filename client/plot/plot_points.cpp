#include "client/plot/plot_points.h"

#include <cmath>

namespace legopt::client {
namespace {

using Json = nlohmann::json;

Json NullIfInfinite(double value) { return std::isfinite(value) ? Json(value) : Json(); }

void AddRow(const std::string& panel, Json curve, Json x, Json y, const PlotRange* range, const PlotBox* box,
            Listing* listing) {
  const auto low = [](const PlotRange* bounds) { return bounds == nullptr ? Json() : NullIfInfinite(bounds->low); };
  const auto high = [](const PlotRange* bounds) { return bounds == nullptr ? Json() : NullIfInfinite(bounds->high); };
  const PlotRange* quartiles = box == nullptr ? nullptr : &box->quartiles;
  listing->rows.push_back(
      {panel, std::move(curve), std::move(x), std::move(y), low(range), high(range), low(quartiles), high(quartiles)});
}

}  // namespace

Listing PointsOf(const Plot& plot) {
  Listing listing;
  listing.columns = {"panel", "curve", "x", "y", "low", "high", "quartile_low", "quartile_high"};
  for (const PlotPanel& panel : plot.panels) {
    for (const PlotSeries& series : panel.series) {
      const Json curve = series.entry < plot.entries.size() ? Json(plot.entries[series.entry]) : Json();
      for (std::size_t i = 0; i < series.points.size(); ++i) {
        const PlotRange* range = series.box ? &series.box->whiskers : series.band.empty() ? nullptr : &series.band[i];
        const PlotPoint& point = series.points[i];
        AddRow(panel.title, curve, NullIfInfinite(point.x), NullIfInfinite(point.y), range,
               series.box ? &*series.box : nullptr, &listing);
      }
    }
    for (const PlotRange& group : panel.groups) AddRow(panel.title, {}, {}, {}, &group, nullptr, &listing);
  }
  return listing;
}

}  // namespace legopt::client
