#include "db/backup.h"

#include <chrono>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

using Seconds = std::chrono::duration<double>;

struct BackupOptions {
  std::optional<std::string> db;
  std::vector<std::string> files;
};

struct RestoreOptions {
  std::string backup, db;
};

// Returns e.g. "3 experiments, 20 jobs, 12 results (schema 10); 1.5 MiB in 0.02 s, integrity and foreign keys checked".
std::string Described(const db::BackupReport& report, Seconds took) {
  constexpr double kMebibyte = 1 << 20;
  const std::string size =
      FormatFixed(static_cast<double>(report.bytes) / kMebibyte, 1) + " MiB in " + FormatFixed(took.count(), 2) + " s";
  return std::to_string(report.experiments) + " experiments, " + std::to_string(report.jobs) + " jobs, " +
         std::to_string(report.results) + " results (schema " + std::to_string(report.schema_version) + "); " + size +
         ", integrity and foreign keys checked";
}

ExitCode Backup(const BackupOptions& options) {
  const std::size_t expected = options.db ? 1 : 2;
  if (options.files.size() != expected) {
    throw ClientError(ExitCode::kUsage, options.db
                                            ? "with --db, give one FILE: legopt service backup --db DATABASE COPY"
                                            : "give the database and the copy: legopt service backup DATABASE COPY");
  }
  const std::string& source = options.db ? *options.db : options.files.front();
  const auto begin = std::chrono::steady_clock::now();
  const db::BackupReport report = db::BackUp(source, options.files.back());
  std::cout << app::Printable(options.files.back()) << ": "
            << Described(report, std::chrono::steady_clock::now() - begin) << "\n";
  return ExitCode::kOk;
}

ExitCode Restore(const RestoreOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const db::RestoreReport report = db::Restore(options.backup, options.db);
  std::cout << app::Printable(options.db) << ": " << Described(report.content, std::chrono::steady_clock::now() - begin)
            << "\n";
  if (!report.moved_away.empty()) {
    std::cout << "The former file is " << app::Printable(report.moved_away.string()) << "\n";
  }
  return ExitCode::kOk;
}

}  // namespace

void AddBackupCommand(const app::Command& program, Invocation* invocation) {
  const auto command =
      program.AddCommand("backup", "Copy a database, even one in use, into a new file and check the copy");
  const auto options = std::make_shared<BackupOptions>();
  command.AddOption("--db", options->db, "Database file to copy, instead of the first FILE");
  command
      .AddOption("FILE", options->files,
                 "The database, which a server may be working on, and the copy; an existing file is never overwritten")
      .Required();
  command.WhenChosen([=] { invocation->body = [options] { return Backup(*options); }; });
}

void AddRestoreCommand(const app::Command& program, Invocation* invocation) {
  const auto command =
      program.AddCommand("restore", "Replace a database by a backup and move the former file and its log away");
  const auto options = std::make_shared<RestoreOptions>();
  command.AddOption("BACKUP", options->backup, "Copy made by 'legopt service backup'; it is checked first").Required();
  command.AddOption("--db", options->db, "Database file to replace; no server may be working on it").Required();
  command.WhenChosen([=] { invocation->body = [options] { return Restore(*options); }; });
}

}  // namespace legopt::client
