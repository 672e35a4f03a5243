#include "tests/solvers/heap_count.h"

#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

namespace legopt::test {
long HeapCount() { return -1; }
}  // namespace legopt::test

#else

namespace {
thread_local long count = 0;
}  // namespace

namespace legopt::test {
long HeapCount() { return count; }
}  // namespace legopt::test

// glibc lets a program replace malloc and exports its own under these names.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++count;
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) {
  ++count;
  return __libc_calloc(number, size);
}
void* realloc(void* block, std::size_t size) {
  ++count;
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++count;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  constexpr int kOutOfMemory = 12;  // ENOMEM
  ++count;
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? kOutOfMemory : 0;
}
}

#endif
