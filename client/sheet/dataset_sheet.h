#pragma once

#include <string>

#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// Returns the data sheet of a dataset as one Markdown page: problems, contacts, joints, histograms of the features,
/// how it was made, proofs, limits and tolerances of the judge, content hash.
///
/// Everything is read from the dataset's folder or from constants of the code; the text depends on nothing else. Files
/// that only generated datasets have may be missing: features.csv, generation.json, scenario.json, certificate.json,
/// solutions-*.json, traps/. The proofs of traps are checked again. Throws InputError for one of these files that
/// cannot be read, and CertificateMismatch for a certificate of another dataset.
std::string DatasetSheet(const Dataset& dataset);

}  // namespace legopt::client
