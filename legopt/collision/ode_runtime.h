#pragma once

#include <stdexcept>

namespace legopt {

/// A failed assertion or an error that ODE reported. ODE would end the process; UseOdeOnThisThread installs handlers
/// that throw this exception instead. The text names ODE's condition, function, file and line.
///
/// Catching it around dCollide of two meshes is safe with Debian's ODE: the library is compiled with unwind tables and
/// exceptions, the collider keeps its data on the stack and in the process-wide cache, and each collision query clears
/// that cache before it uses it. `TrimeshFailure` in tests/collision checks the queries after a failure.
class OdeFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Makes ODE usable on the calling thread: process-wide initialisation and error handlers once, ODE's per-thread data
/// once per thread (freed by ODE when the thread ends). Every class that owns ODE objects calls it first, in its
/// constructor and before colliding. Throws OdeFailure when ODE cannot be initialised.
void UseOdeOnThisThread();

}  // namespace legopt
