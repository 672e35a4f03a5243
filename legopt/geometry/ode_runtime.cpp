#include "legopt/geometry/ode_runtime.h"

#include <ode/ode.h>

#include <array>
#include <cstdarg>
#include <cstdio>
#include <mutex>
#include <string>

namespace legopt {
namespace {

constexpr std::size_t kLongestText = 512;

/// Message handler: ODE would report full contact tables and similar events on stderr, but a library must not print.
void Silence(int /*number*/, const char* /*format*/, va_list /*arguments*/) {}

/// Handler of dDebug (assertions) and dError, which abort the process if their handler returns.
[[noreturn]] void Throw(int number, const char* format, va_list arguments) {
  std::array<char, kLongestText> text{};
  if (std::vsnprintf(text.data(), text.size(), format, arguments) < 0) text.front() = '\0';
  throw OdeFailure("ODE, error " + std::to_string(number) + ": " + text.data());
}

}  // namespace

void UseOdeOnThisThread() {
  static std::once_flag process_flag;
  std::call_once(process_flag, [] {
    dSetMessageHandler(&Silence);
    dSetDebugHandler(&Throw);
    dSetErrorHandler(&Throw);
    if (dInitODE2(0) == 0) throw OdeFailure("ODE: dInitODE2 failed");
  });
  static thread_local bool ready = false;
  if (ready) return;
  if (dAllocateODEDataForThread(dAllocateMaskAll) == 0) throw OdeFailure("ODE: dAllocateODEDataForThread failed");
  ready = true;
}

}  // namespace legopt
