#pragma once

#include <string>

#include "client/report/listing.h"
#include "legopt/dataset/dataset.h"
#include "legopt/planning/certify/certificate.h"
#include "legopt/planning/certify/stance_catalogue.h"

namespace legopt::client {

/// Returns a row per task: problems, certified, infeasible, open.
Listing FeasibilityCounts(const certify::Certificate& certificate, const certify::StanceCatalogue& catalogue);

/// Returns a row per uncertified stance: task, problem, index of the stance in it, feasibility, reason, and the
/// violation of the best attempt. A stance of several problems has a row for each.
Listing UncertifiedStances(const certify::Certificate& certificate, const certify::StanceCatalogue& catalogue,
                           const Dataset& dataset);

/// Renders both tables in one text; CSV contains the counts only, JSON both.
std::string RenderFeasibility(const certify::Certificate& certificate, const certify::StanceCatalogue& catalogue,
                              const Dataset& dataset, TableFormat format, const TextLayout& layout = {});

}  // namespace legopt::client
