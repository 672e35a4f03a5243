#pragma once

#include <string>

namespace legopt {

/// Returns 16 hex digits: a hash of numerical results from code outside of this program, which may differ between
/// hosts. It covers elementary functions (of libm, or pinned_functions), contacts of ODE, and the BLAS and LAPACK of
/// Ipopt, if loaded. Processes with the same program and the same fingerprint solve a job with identical bits, as
/// far as these samples can show.
///
/// Takes well below a millisecond. Any thread.
std::string NumericFingerprint();

}  // namespace legopt
