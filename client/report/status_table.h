#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "client/report/listing.h"
#include "client/service/experiment_status.h"

namespace legopt::client {

/// The experiments of a server for people, no line longer than `width` columns where that is at least 40; 0: no limit.
/// Wide, one line for each:
///
///     ID  NAME   BY   DATASET  METHODS     TAGS   PRIORITY        JOBS  SOLVED  SHARE   ETA  STATE
///      3  quick  ann  garage   SQP, Adam   paper         0  52/80 65 %      38   50 %  0:12  active
///
/// Narrow, when that does not fit: without the columns from DATASET to PRIORITY, which an active experiment has on a
/// line of their own; names and states are cut with "...". Columns that no experiment has (BY, TAGS, PRIORITY, SHARE,
/// ETA) are left out. The state of one that stands still is the reason. Texts are taken as they are.
std::string RenderExperiments(std::span<const ExperimentStatus> experiments, std::size_t width);

/// The same with every column, for the other formats.
Listing ExperimentListing(std::span<const ExperimentStatus> experiments);

/// The workers of a status reply for people, in the same way: pid and build only where there is room.
std::string RenderWorkers(const nlohmann::json& workers, std::size_t width);

}  // namespace legopt::client
