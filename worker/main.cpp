#include "legopt/solve/numeric_fingerprint.h"
#include "worker/solve_executor.h"
#include "worker/worker_main.h"

int main(int argc, char** argv) {
  return legopt::worker::WorkerMain(argc, argv, legopt::programs::ThisBuild(legopt::NumericFingerprint()),
                                    [](legopt::worker::WorkerInputs inputs) {
                                      return std::make_unique<legopt::worker::SolveExecutor>(std::move(inputs));
                                    });
}
