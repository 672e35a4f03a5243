// Creates a database of millions of results to measure tables, servers and backups:
//
//   large_database FILE [--experiments 10]
//   time legopt table --db FILE
//
// An experiment has a million results and takes 560 MB and about half a minute.

#include <CLI/CLI.hpp>
#include <cstdio>

#include "db/sqlite_store.h"
#include "tests/bench/filled_tables.h"
#include "tests/guarded_main.h"

namespace {

int Main(int argc, char** argv) {
  std::string file;
  int experiments = 10;
  CLI::App app{"Makes a database of millions of results"};
  app.add_option("FILE", file, "To be created")->required()->check(CLI::NonexistentPath);
  app.add_option("--experiments", experiments, "Of a million results each")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  { legopt::db::OpenSqliteStore(file); }
  legopt::db::FillTables(file, experiments);
  std::printf("%s: %d experiments of %lld results\n", file.c_str(), experiments,
              static_cast<long long>(legopt::db::kResultsPerExperiment));
  return 0;
}

}  // namespace

int main(int argc, char** argv) { return legopt::GuardedMain(argc, argv, Main); }
