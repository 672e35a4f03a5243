#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "client/report/benchmark_table.h"
#include "client/report/listing.h"
#include "client/report/reading.h"
#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"
#include "legopt/planning/certify/certificate.h"

namespace legopt::client {

/// Reads the certificate `file`, or the one in the dataset folder `file`. Throws CertificateMismatch if it belongs to
/// another dataset than the experiment's, InputError if it cannot be read.
certify::ProblemFeasibility ReadCertificateOf(std::filesystem::path file, const ExperimentInfo& experiment);

/// Returns the certificate in a dataset's folder, if it exists and belongs to the experiment's dataset. Throws
/// InputError if it cannot be read.
std::optional<certify::ProblemFeasibility> FindCertificate(const std::filesystem::path& folder,
                                                           const ExperimentInfo& experiment);

/// Returns the certificate of the embedded dataset of the experiment, if any. Throws the errors of FindCertificate.
std::optional<certify::ProblemFeasibility> FindEmbeddedCertificate(const ExperimentInfo& experiment);

/// Splits the jobs of every cell by the feasibility of their problems. Problems that are not in the certificate are
/// open. An open problem that any method of the experiment solved counts as certified. Only the jobs of other
/// problems are read. Throws the errors of ReadBenchmarkTable.
void AddCertifiedCounts(ResultSource& source, const certify::ProblemFeasibility& certificate, BenchmarkTable* table);

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
