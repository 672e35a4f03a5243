#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"
#include "tests/doubles/memory_store.h"

/// Guarantees of every Store, tested with both implementations: the fixture of store_conformance_test.cpp (jobs,
/// attempts, results, workers, events) and store_experiments_test.cpp (experiments and operator commands on them).
namespace legopt::db {

enum class StoreKind { kSqlite, kMemory };

class StoreConformance : public testing::TestWithParam<StoreKind> {
 protected:
  void SetUp() override { Open(); }

  void Open() {
    if (GetParam() == StoreKind::kSqlite) {
      sqlite_.reset();  // releases the lock first
      sqlite_ = OpenSqliteStore(folder_ / "store.sqlite");
    }
  }
  // Opens the store again, as after a restart of the server: applied operations are present, and nothing else.
  void Reopen() { Open(); }

  Store& store() { return GetParam() == StoreKind::kSqlite ? *sqlite_ : memory_; }
  void Apply(const std::vector<StoreOp>& ops) { store().Apply(ops); }

  void ExpectRefused(const std::vector<StoreOp>& ops) {
    try {
      store().Apply(ops);
      ADD_FAILURE() << "an illegal operation was applied";
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), StoreErrorCode::kConstraint) << error.what();
    }
  }

  // Creates experiment 1 with jobs 1 - 4 in cells 1 and 2, and worker 1.
  void Prepare() { Apply({CreateExperiment{SampleExperiment(1, 1, 1)}, PutWorker{SampleWorker(1)}}); }

  OpenJob JobInStore(std::int64_t job_id) {
    const OpenState state = store().LoadOpenState();
    return state.open.at(0).jobs.at(static_cast<std::size_t>(job_id - state.experiments.at(0).first_job_id));
  }

 private:
  TemporaryFolder folder_;
  std::unique_ptr<Store> sqlite_;
  MemoryStore memory_;
};

}  // namespace legopt::db
