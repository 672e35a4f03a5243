#pragma once

namespace legopt::test {

/// Returns the number of calls of operator new on this thread since it started, in this test program.
long AllocationCount();

}  // namespace legopt::test
