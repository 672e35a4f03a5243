#pragma once

namespace legopt::test {

/// Blocks that this thread has asked the heap for since it started: malloc and everything on top of it (operator new,
/// Eigen, ODE). -1 under a sanitizer, which has a heap of its own.
long HeapCount();

}  // namespace legopt::test
