#pragma once

namespace legopt {

/// Makes ODE usable on the calling thread: process-wide initialisation once, ODE's per-thread data once per thread
/// (freed by ODE when the thread ends). Every class that owns ODE objects calls it first, in its constructor and before
/// colliding. Aborts when ODE cannot be initialised.
void UseOdeOnThisThread();

}  // namespace legopt
