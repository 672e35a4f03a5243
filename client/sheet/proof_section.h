#pragma once

#include <string>

#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// Returns the section of a data sheet about proofs: certificate.json, planted solutions, what features.csv says about
/// feet alone, and the proofs of traps, which are checked again. Throws InputError and CertificateMismatch.
std::string ProofSection(const Dataset& dataset);

}  // namespace legopt::client
