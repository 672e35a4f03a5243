#pragma once

namespace legopt::test {

/// Returns the number of heap blocks that this thread has allocated since it started: malloc and everything based on
/// it (operator new, Eigen, ODE). -1 under a sanitizer, which has a heap of its own.
long HeapCount();

}  // namespace legopt::test
