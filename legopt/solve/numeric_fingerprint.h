#pragma once

#include <string>

namespace legopt {

/// 16 hex digits: the bits that this process gets from what it does not hold itself and may differ from host to host,
/// as a hash. Elementary functions (those of libm, or pinned_functions), contacts of ODE, and the BLAS and LAPACK under
/// Ipopt, where they are loaded. Processes with the same program and the same fingerprint solve a job to the same bits,
/// as far as these samples can tell.
///
/// Takes well below a millisecond. Any thread.
std::string NumericFingerprint();

}  // namespace legopt
