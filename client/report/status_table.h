#pragma once

#include <span>

#include "client/report/listing.h"
#include "client/service/experiment_status.h"

namespace legopt::client {

/// Returns the experiments of a server as shown in text:
///
///     ID  NAME   BY   DATASET  METHODS     TAGS   PRIORITY        JOBS  SOLVED  SHARE   ETA  STATE
///      3  quick  ann  garage   SQP, Adam   paper         0  52/80 65 %      38   50 %  0:12  active
///
/// Columns without values (BY, TAGS, PRIORITY, SHARE, ETA) are omitted. The state of a stalled experiment is the
/// reason.
Table ExperimentTable(std::span<const ExperimentStatus> experiments);

/// Returns all columns, for the other formats.
Listing ExperimentListing(std::span<const ExperimentStatus> experiments);

/// Returns the workers of a status reply in the same way.
Table WorkerTable(const nlohmann::json& workers);

/// Returns a line with the number of workers that a status reply does not list; empty if it lists all.
std::string UnlistedWorkers(const nlohmann::json& status);

}  // namespace legopt::client
