#include "db/backup.h"

#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <string>

#include "client/commands/commands.h"
#include "programs/command_line.h"
#include "programs/printable.h"

namespace legopt::client {
namespace {

struct BackupOptions {
  std::string db;
  std::string target;
};

ExitCode Backup(const BackupOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const db::BackupReport report = db::BackUp(options.db, options.target);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  constexpr double kMebibyte = 1 << 20;
  char size[64];
  std::snprintf(size, sizeof(size), "%.1f MiB in %.2f s", static_cast<double>(report.bytes) / kMebibyte, took.count());
  std::cout << programs::Printable(options.target) << ": " << report.experiments << " experiments, " << report.jobs
            << " jobs, " << report.results << " results (schema " << report.schema_version << "); " << size
            << ", integrity and foreign keys checked\n";
  return ExitCode::kOk;
}

}  // namespace

void AddBackupCommand(const programs::Command& program, Invocation* invocation) {
  const auto command =
      program.AddCommand("backup", "Copy a database, also one in use, into a new file, and check the copy");
  const auto options = std::make_shared<BackupOptions>();
  command.AddOption("--db", options->db, "Database file to copy; a server may be working on it").Required();
  command.AddOption("FILE", options->target, "The copy; an existing file is never overwritten").Required();
  command.WhenChosen([=] { invocation->body = [options] { return Backup(*options); }; });
}

}  // namespace legopt::client
