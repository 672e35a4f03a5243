#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "client/report/listing.h"
#include "client/service/experiment_status.h"

namespace legopt::client {

/// Renders the experiments of a server as text, with lines of at most `width` columns (at least 40); 0: no limit. Wide
/// layout, one line each:
///
///     ID  NAME   BY   DATASET  METHODS     TAGS   PRIORITY        JOBS  SOLVED  SHARE   ETA  STATE
///      3  quick  ann  garage   SQP, Adam   paper         0  52/80 65 %      38   50 %  0:12  active
///
/// Narrow layout if that does not fit: without the columns from DATASET to PRIORITY, which are on a separate line for
/// active experiments; names and states are truncated with "...". Columns without values (BY, TAGS, PRIORITY, SHARE,
/// ETA) are omitted. The state of a stalled experiment is the reason. Texts are not escaped.
std::string RenderExperiments(std::span<const ExperimentStatus> experiments, std::size_t width);

/// Returns all columns, for the other formats.
Listing ExperimentListing(std::span<const ExperimentStatus> experiments);

/// Renders the workers of a status reply in the same way; pid and build are shown only if there is space.
std::string RenderWorkers(const nlohmann::json& workers, std::size_t width);

}  // namespace legopt::client
