// legopt-worker in everything but the jobs: see stub_executor.h.

#include "tests/service/stub_executor.h"
#include "worker/worker_main.h"

int main(int argc, char** argv) {
  return legopt::worker::WorkerMain(argc, argv, [](std::vector<std::filesystem::path> folders) {
    return std::make_unique<legopt::worker::StubExecutor>(std::move(folders));
  });
}
