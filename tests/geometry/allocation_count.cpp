#include "tests/geometry/allocation_count.h"

#include <cstdlib>
#include <new>

namespace {
thread_local long count = 0;
}  // namespace

namespace legopt::test {
long AllocationCount() { return count; }
}  // namespace legopt::test

void* operator new(std::size_t size) {
  ++count;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++count;
  return std::malloc(size);
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, const std::nothrow_t&) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
