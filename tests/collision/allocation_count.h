#pragma once

namespace legopt::test {

/// Calls of operator new on this thread since it started, in this test program.
long AllocationCount();

}  // namespace legopt::test
