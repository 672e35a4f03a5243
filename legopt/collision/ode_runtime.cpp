#include "legopt/collision/ode_runtime.h"

#include <ode/ode.h>

#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <mutex>

namespace legopt {
namespace {

/// ODE reports full contact tables and the like on stderr; a library does not print.
void Silence(int /*number*/, const char* /*format*/, va_list /*arguments*/) {}

[[noreturn]] void Fail(const char* call) {
  std::fprintf(stderr, "ODE: %s failed\n", call);
  std::abort();
}

}  // namespace

void UseOdeOnThisThread() {
  static std::once_flag process_flag;
  std::call_once(process_flag, [] {
    if (dInitODE2(0) == 0) Fail("dInitODE2");
    dSetMessageHandler(&Silence);
  });
  static thread_local bool ready = false;
  if (ready) return;
  if (dAllocateODEDataForThread(dAllocateMaskAll) == 0) Fail("dAllocateODEDataForThread");
  ready = true;
}

}  // namespace legopt
