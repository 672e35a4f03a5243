#pragma once

#include <string>

#include "client/report/listing.h"
#include "legopt/certify/certificate.h"
#include "legopt/certify/stance_catalogue.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// A row per task: problems, certified, infeasible, open.
Listing FeasibilityCounts(const certify::Certificate& certificate, const certify::StanceCatalogue& catalogue);

/// A row per stance that is not certified: task, problem, place of the stance in it, feasibility, reason, and what the
/// nearest attempt lacks. A stance of several problems has a row for each.
Listing UncertifiedStances(const certify::Certificate& certificate, const certify::StanceCatalogue& catalogue,
                           const Dataset& dataset);

/// Both, in one text; CSV and JSON are for programs: CSV has the counts, JSON both.
std::string RenderFeasibility(const certify::Certificate& certificate, const certify::StanceCatalogue& catalogue,
                              const Dataset& dataset, ListingFormat format, const TextLayout& layout = {});

}  // namespace legopt::client
