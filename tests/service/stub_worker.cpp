// legopt-worker in everything but the jobs: see stub_executor.h.

#include <cstdlib>

#include "tests/service/stub_executor.h"
#include "worker/worker_main.h"

namespace {

// One build for all stubs; LEGOPT_STUB_BUILD in the environment makes another.
legopt::programs::BuildFacts Build() {
  const char* other = std::getenv("LEGOPT_STUB_BUILD");
  legopt::programs::BuildFacts build;
  build.version = other == nullptr ? "stub" : other;
  return build;
}

}  // namespace

int main(int argc, char** argv) {
  return legopt::worker::WorkerMain(argc, argv, Build(), [](legopt::worker::WorkerInputs inputs) {
    return std::make_unique<legopt::worker::StubExecutor>(std::move(inputs.datasets));
  });
}
