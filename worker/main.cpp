#include "app/program_main.h"
#include "legopt/planning/internal/numeric_fingerprint.h"
#include "worker/solve_executor.h"
#include "worker/worker_main.h"

int main(int argc, char** argv) {
  namespace worker = legopt::worker;
  return legopt::app::RunProgram("legopt-worker", worker::KindOf(argc, argv), [&] {
    return worker::WorkerMain(
        argc, argv, legopt::app::ThisBuild(legopt::NumericFingerprint()),
        [](worker::WorkerInputs inputs) { return std::make_unique<worker::SolveExecutor>(std::move(inputs)); });
  });
}
