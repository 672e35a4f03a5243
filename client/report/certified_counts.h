#pragma once

#include <filesystem>
#include <optional>

#include "client/report/benchmark_table.h"
#include "client/report/reading.h"
#include "client/report/result_source.h"
#include "legopt/certify/certificate.h"

namespace legopt::client {

/// The certificate `file`, or that in the dataset's folder `file`. Throws CertificateMismatch when it is about another
/// dataset than the experiment, InputError when it cannot be read.
certify::ProblemFeasibility ReadCertificateOf(std::filesystem::path file, const ExperimentInfo& experiment);

/// The certificate in a dataset's folder, if there is one and it is about the experiment's dataset. Throws InputError
/// when it cannot be read.
std::optional<certify::ProblemFeasibility> FindCertificate(const std::filesystem::path& folder,
                                                           const ExperimentInfo& experiment);

/// That of the embedded dataset which the experiment is on, if it has one. Throws as FindCertificate.
std::optional<certify::ProblemFeasibility> FindEmbeddedCertificate(const ExperimentInfo& experiment);

/// Splits the jobs of every cell by what the certificate says of their problems. Problems that it does not have are
/// open. Errors as of ReadBenchmarkTable.
void AddCertifiedCounts(ResultSource& source, const TableSelection& selection,
                        const certify::ProblemFeasibility& certificate, BenchmarkTable* table);

}  // namespace legopt::client
