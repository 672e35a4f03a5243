// Equals legopt-worker except for the jobs: see stub_executor.h.

#include <cstdlib>

#include "app/program_main.h"
#include "tests/service/stub_executor.h"
#include "worker/worker_main.h"

namespace {

// Returns the same build for all stubs; LEGOPT_STUB_BUILD in the environment selects another.
legopt::app::BuildFacts Build() {
  const char* other = std::getenv("LEGOPT_STUB_BUILD");
  legopt::app::BuildFacts build;
  build.version = other == nullptr ? "stub" : other;
  return build;
}

}  // namespace

int main(int argc, char** argv) {
  namespace worker = legopt::worker;
  return legopt::app::RunProgram("legopt-worker", worker::KindOf(argc, argv), [&] {
    return worker::WorkerMain(argc, argv, Build(), [](worker::WorkerInputs inputs) {
      return std::make_unique<worker::StubExecutor>(std::move(inputs.datasets));
    });
  });
}
