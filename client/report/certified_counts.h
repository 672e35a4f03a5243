#pragma once

#include <filesystem>
#include <optional>

#include "client/report/benchmark_table.h"
#include "client/report/reading.h"
#include "client/report/result_source.h"
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

/// Splits the jobs of every cell by the certified feasibility of their problems. Problems that are not in the
/// certificate are open. Throws the errors of ReadBenchmarkTable.
void AddCertifiedCounts(ResultSource& source, const TableSelection& selection,
                        const certify::ProblemFeasibility& certificate, BenchmarkTable* table);

}  // namespace legopt::client
