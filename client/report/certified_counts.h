#pragma once

#include <filesystem>
#include <optional>

#include "client/report/benchmark_table.h"
#include "client/report/reading.h"
#include "client/report/result_source.h"
#include "legopt/certify/certificate.h"

namespace legopt::client {

/// The certificate that a table counts by: the file `given`, or that of a dataset's folder when it is one; without it
/// that of the embedded dataset, if it is about the experiment's. Throws CertificateMismatch when the given one is
/// about another dataset than the experiment, InputError when it cannot be read.
std::optional<certify::ProblemFeasibility> FindCertificate(const std::optional<std::filesystem::path>& given,
                                                           const ExperimentInfo& experiment);

/// Splits the jobs of every cell by what the certificate says of their problems. Problems that it does not have are
/// open. Errors as of ReadBenchmarkTable.
void AddCertifiedCounts(ResultSource& source, const TableSelection& selection,
                        const certify::ProblemFeasibility& certificate, BenchmarkTable* table);

}  // namespace legopt::client
