// Creates a database of millions of results to measure tables, servers and backups:
//
//   large_database FILE [--experiments 10] [--problems 15625]
//   time legopt table --db FILE
//
// An experiment of a million results takes 560 MB and about half a minute.

#include <CLI/CLI.hpp>
#include <cstdio>

#include "db/sqlite_store.h"
#include "tests/bench/filled_tables.h"
#include "tests/guarded_main.h"

namespace {

int Main(int argc, char** argv) {
  std::string file;
  int experiments = 10, problems = legopt::db::kProblemsOfAMillion;
  CLI::App app{"Makes a database of millions of results"};
  app.add_option("FILE", file, "To be created")->required()->check(CLI::NonexistentPath);
  app.add_option("--experiments", experiments, "Experiments")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--problems", problems, "Problems of each task: a 64th of an experiment's results")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  { legopt::db::OpenSqliteStore(file); }
  legopt::db::FillTables(file, experiments, problems);
  std::printf("%s: %d experiments of %lld results\n", file.c_str(), experiments,
              static_cast<long long>(legopt::db::JobsOf(problems)));
  return 0;
}

}  // namespace

int main(int argc, char** argv) { return legopt::GuardedMain(argc, argv, Main); }
