#pragma once

#include <stdexcept>

namespace legopt {

/// A failed assertion or an error reported by ODE. ODE would abort the process; UseOdeOnThisThread installs handlers
/// that throw this exception instead. The text contains ODE's condition, function, file and line.
///
/// Catching it around dCollide of two meshes is safe with Debian's ODE: the library is compiled with unwind tables and
/// exceptions, the collider keeps its data on the stack and in the process-wide cache, and each collision query clears
/// that cache first. `TrimeshFailure` in tests/geometry checks queries after a failure.
class OdeFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Prepares ODE for the calling thread: process-wide initialization and error handlers once, ODE's per-thread data once
/// per thread (freed by ODE when the thread ends). Classes that own ODE objects call it in their constructor and before
/// colliding. Throws OdeFailure if ODE cannot be initialized.
void UseOdeOnThisThread();

}  // namespace legopt
