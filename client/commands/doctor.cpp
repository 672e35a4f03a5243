#include "client/commands/doctor.h"

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <iostream>
#include <limits>
#include <memory>

#include "app/command_line.h"
#include "app/data_folder.h"
#include "app/folder_cache.h"
#include "app/printable.h"
#include "bus/bus_error.h"
#include "bus/messages.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/output.h"
#include "client/report/progress.h"
#include "client/service/experiment_status.h"
#include "client/suite/input_files.h"
#include "db/audit.h"
#include "db/named_queries.h"
#include "db/read_only_database.h"
#include "legopt/dataset/dataset.h"
#include "legopt/files/written_file.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"
#include "legopt/types/task.h"

namespace legopt::client {
namespace {

using State = DoctorDiagnostic::State;

// Timeout of doctor's probe; a running server answers within milliseconds.
constexpr double kProbeTimeout_s = 1.5;

std::string_view StateWord(State state) {
  switch (state) {
    case State::kOk:
      return "ok";
    case State::kWarn:
      return "warn";
    case State::kFail:
      return "fail";
  }
  return "";
}

DoctorDiagnostic CheckVersions(const app::BuildFacts& build) {
  return {"versions", State::kOk,
          app::BuildName(build) + ", build " + app::BuildId(build) + ", protocol " +
              std::to_string(bus::kProtocolVersion) + ", " LEGOPT_BUILT_WITH ", " + build.libraries,
          "", ExitCode::kOk};
}

DoctorDiagnostic CheckPrograms() {
  const auto folder = app::ProgramFolder();
  std::string missing;
  for (const char* program : {"legopt-server", "legopt-worker"}) {
    if (::access((folder / program).c_str(), X_OK) != 0)
      missing += (missing.empty() ? "" : ", ") + std::string(program);
  }
  if (missing.empty()) return {"programs", State::kOk, "legopt-server and legopt-worker in " + folder.string(), "", {}};
  return {"programs", State::kFail, missing + " not found in " + folder.string(),
          "build or install all three programs in one folder", ExitCode::kMachine};
}

DoctorDiagnostic CheckData() {
  try {
    return {"data", State::kOk, "embedded suites and datasets in " + app::DataFolder().string(), "", {}};
  } catch (const InputError& error) {
    return {"data", State::kFail, error.what(), "", ExitCode::kUsage};
  }
}

DoctorDiagnostic CheckRoute(const bus::LcmOptions& network) {
  const auto route = bus::ProbeMulticastRoute(network.group, network.ttl);
  if (route.usable) return {"multicast route", State::kOk, network.group + " through " + route.interface, "", {}};
  return {"multicast route", State::kFail, network.group + " cannot be used", route.problem,
          ExitCode::kNetworkUnusable};
}

DoctorDiagnostic CheckBuffers(const bus::LcmOptions& network, const bus::LcmTransport& transport) {
  constexpr std::size_t kKiB = 1024;
  // The kernel reports twice the granted size: payload and its own overhead.
  const std::string detail = std::to_string(transport.granted_receive_buffer_bytes() / 2 / kKiB) + " KiB of " +
                             std::to_string(network.receive_buffer_bytes / kKiB) + " KiB granted per port" +
                             (transport.socket_filter_attached() ? ", socket filter attached" : "");
  const std::string warning = transport.receive_buffer_warning();
  return {"receive buffers", warning.empty() ? State::kOk : State::kWarn, detail, warning, {}};
}

DoctorDiagnostic CheckKey(const bus::LcmOptions& network, const bus::LcmTransport& transport) {
  if (transport.key() != nullptr) return {"message tags", State::kOk, "keyed by " + network.key_file, "", {}};
  const std::string warning = transport.missing_key_warning();
  if (network.ttl == 0) return {"message tags", State::kOk, warning, "", {}};
  return {"message tags", State::kWarn, "messages leave this machine without a key", warning, {}};
}

DoctorDiagnostic CheckServer(const legopt_msg::probe_reply& probe, const std::string& address,
                             const std::string& version) {
  const std::string detail = "legopt-server " + probe.server_version + " at " + address + " on " + probe.hostname +
                             ", database " + probe.database + ", up " +
                             FormatDuration(std::chrono::microseconds(probe.uptime_us));
  if (probe.protocol_version != bus::kProtocolVersion) {
    return {"server", State::kFail, detail + ", protocol " + std::to_string(probe.protocol_version),
            "use server and client of the same release", ExitCode::kUnreachable};
  }
  if (probe.server_version.find(version) == std::string::npos) {
    return {"server", State::kWarn, detail, "this client is " + version + "; better use the same release", {}};
  }
  return {"server", State::kOk, detail, "", {}};
}

// Checks whether the server can write its database: on this disk, under this name.
DoctorDiagnostic CheckServersDatabase(ServerConnection& server) {
  constexpr std::int64_t kNoExperiment = std::numeric_limits<std::int64_t>::max();  // keeps the answer small
  const std::string error = StoreError(server.Status(kNoExperiment));
  if (error.empty()) return {"server's database", State::kOk, "can be written", "", {}};
  return {"server's database", State::kFail, error, "nothing is leased or acknowledged until then",
          ExitCode::kDatabaseUnusable};
}

DoctorDiagnostic CheckClock(const std::optional<legopt_msg::probe_reply>& probe) {
  using std::chrono::microseconds;
  constexpr double kToleratedDifference_s = 2.0;
  constexpr std::int64_t kSomeTimeIn2024_s = 1'704'067'200;
  const auto now = std::chrono::duration_cast<microseconds>(std::chrono::system_clock::now().time_since_epoch());
  const std::time_t seconds = static_cast<std::time_t>(now.count() / 1'000'000);
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  char text[40];
  std::strftime(text, sizeof(text), "%Y-%m-%d %H:%M:%S UTC", &utc);
  std::string detail = text;
  if (seconds < kSomeTimeIn2024_s) {
    return {"clock", State::kWarn, detail, "the clock is wrong; set it (e.g. 'timedatectl set-ntp true')", {}};
  }
  if (probe) {
    const double difference_s = static_cast<double>(now.count() - probe->wall_clock_us) * 1e-6;
    detail += ", " + FormatFixed(difference_s, 3) + " s from the server's";
    if (std::abs(difference_s) > kToleratedDifference_s) {
      return {
          "clock", State::kWarn, detail, "synchronise the clocks (NTP); times in the database are the server's", {}};
    }
  }
  return {"clock", State::kOk, detail, "", {}};
}

void CheckNetwork(const DiagnosisOptions& options, std::vector<DoctorDiagnostic>* findings) {
  std::optional<legopt_msg::probe_reply> probe;
  try {
    NetworkOptions network = options.network;
    network.timeout_s = std::min(network.timeout_s, kProbeTimeout_s);
    const bus::LcmOptions resolved = network.Resolve();
    findings->push_back(CheckRoute(resolved));
    if (findings->back().state == State::kOk) {
      ServerConnection server(network);
      findings->push_back(CheckBuffers(resolved, server.transport()));
      findings->push_back(CheckKey(resolved, server.transport()));
      try {
        probe = server.Probe();
        findings->push_back(CheckServer(*probe, server.address(), options.build.version));
        if (findings->back().state != State::kFail) findings->push_back(CheckServersDatabase(server));
      } catch (const ClientError& error) {
        findings->push_back({"server",
                             State::kWarn,
                             "none answers at " + server.address(),
                             "not needed for 'legopt run'; else start one: legopt-server --db results.sqlite",
                             {}});
        if (error.code() != ExitCode::kUnreachable)
          findings->back() = {"server", State::kFail, error.what(), "", error.code()};
      }
    }
  } catch (const bus::BusError& error) {
    findings->push_back(
        {"network", State::kFail, error.what(), "",
         error.code() == bus::BusErrorCode::kInvalidOption ? ExitCode::kUsage : ExitCode::kNetworkUnusable});
  }
  findings->push_back(CheckClock(probe));
}

// Returns e.g. "40 a and 35 b".
std::string CountProblems(const Dataset& dataset) {
  std::string text;
  for (const TaskDescription& row : ProblemTasks()) {
    text += (text.empty() ? "" : " and ") + std::to_string(dataset.problems(row.task).size()) + " " +
            std::string(ToString(row.task));
  }
  return text;
}

DoctorDiagnostic CheckDataset(const DiagnosisOptions& options) {
  try {
    const auto dataset = Dataset::Load(ChooseDatasetFolder(options.dataset, nullptr), GuardedReader());
    return {"dataset",
            State::kOk,
            dataset->name() + " in " + dataset->folder().string() + ", " + CountProblems(*dataset) +
                " problems, hash " + dataset->content_hash(),
            "",
            {}};
  } catch (const InputError& error) {
    return {"dataset", State::kFail, error.what(), "", ExitCode::kUsage};
  } catch (const ClientError& error) {
    return {"dataset", State::kFail, error.what(), "", error.code()};
  }
}

// Returns one finding per violated rule; empty if the file is undamaged.
std::vector<DoctorDiagnostic> CheckInside(const std::string& file) {
  std::vector<DoctorDiagnostic> findings;
  for (const db::AuditDiagnostic& defect : db::Audit(file)) {
    const std::string more = defect.places > 1 ? " (and " + std::to_string(defect.places - 1) + " more)" : "";
    findings.push_back({"database: " + defect.rule, State::kFail, defect.detail + more,
                        "stop the server and restore a backup, or go on reading with care",
                        ExitCode::kDatabaseUnusable});
  }
  return findings;
}

DoctorDiagnostic Summarise(const std::string& file) {
  db::ReadOnlyDatabase database(file);
  const auto result = database.Query(db::Sql(db::Query::kDatabaseSummary), 1);
  const auto number = [&](std::size_t column) {
    return std::to_string(std::get<std::int64_t>(result.rows.at(0).at(column)));
  };
  return {"database",
          State::kOk,
          file + ": " + number(0) + " experiments, " + number(1) + " jobs; " + std::to_string(db::AuditRules().size()) +
              " rules kept",
          "",
          {}};
}

// Returns the finding for a database of which no copy can be made.
DoctorDiagnostic NotChecked(const std::string& file, const std::string& cause, ExitCode code) {
  return {"database", State::kFail, file + ": not checked, because the check needs a temporary copy", cause, code};
}

void CheckDatabase(const std::string& file, std::vector<DoctorDiagnostic>* findings) {
  try {
    const auto defects = CheckInside(file);
    findings->insert(findings->end(), defects.begin(), defects.end());
    if (defects.empty()) findings->push_back(Summarise(file));
  } catch (const files::FileError& error) {
    findings->push_back(NotChecked(file, error.what(), error.shortage() ? ExitCode::kMachine : ExitCode::kUsage));
  } catch (const db::StoreError& error) {
    const bool newer = error.code() == db::StoreErrorCode::kNewerSchema;
    findings->push_back(
        {"database", State::kFail, error.what(), "", newer ? ExitCode::kNewerDatabase : ExitCode::kDatabaseUnusable});
    // The file is only read, so the disk of the copy is full.
    if (error.code() == db::StoreErrorCode::kFull) findings->back() = NotChecked(file, error.what(), ExitCode::kUsage);
  }
}

}  // namespace

std::vector<DoctorDiagnostic> Diagnose(const DiagnosisOptions& options) {
  std::vector<DoctorDiagnostic> findings = {CheckVersions(options.build), CheckPrograms(), CheckData()};
  CheckNetwork(options, &findings);
  findings.push_back(CheckDataset(options));
  if (options.db) CheckDatabase(*options.db, &findings);
  return findings;
}

std::string RenderFindings(const std::vector<DoctorDiagnostic>& findings, TableFormat format,
                           const TextLayout& layout) {
  const bool text = format == TableFormat::kText;
  Table table;
  table.has_headings = !text;
  const auto column = [](const char* name) { return TableColumn{name, "", "", Alignment::kLeft}; };
  table.columns = text ? std::vector{column("state"), column("check"), column("detail")}
                       : std::vector{column("check"), column("state"), column("detail"), column("fix")};
  for (const auto& finding : findings) {
    const TableCell state = TextCell(std::string(StateWord(finding.state))), check = TextCell(finding.check),
                    detail = TextCell(finding.detail);
    if (!text) {
      table.rows.push_back({{check, state, detail, TextCell(finding.fix)}});
      continue;
    }
    table.rows.push_back({{state, check, detail}});
    if (!finding.fix.empty()) table.rows.push_back({{TextCell(""), TextCell(""), TextCell("-> " + finding.fix)}});
  }
  return RenderTable(table, format, layout);
}

ExitCode WorstOf(const std::vector<DoctorDiagnostic>& findings) {
  for (const auto& finding : findings) {
    if (finding.state == State::kFail) return finding.code;
  }
  return ExitCode::kOk;
}

namespace {

struct DoctorOptions {
  DiagnosisOptions diagnosis;
  TableFormat format = TableFormat::kText;
};

ExitCode Doctor(const DoctorOptions& options) {
  const auto findings = Diagnose(options.diagnosis);
  const std::string text = RenderFindings(findings, options.format, LayoutOf({}));
  std::cout << (options.format == TableFormat::kCsv ? CsvFor(StandardOutput(), text) : text);
  return WorstOf(findings);
}

}  // namespace

void AddDoctorCommand(const app::Command& program, Invocation* invocation) {
  const auto command =
      program.AddCommand("doctor", "Check network, programs, server, clock, dataset; says what to fix");
  const auto options = std::make_shared<DoctorOptions>();
  AddDatasetOption(command, &options->diagnosis.dataset);
  command.AddOption("--db", options->diagnosis.db,
                    "Also check this database file: integrity, foreign keys, schema and consistency of rows");
  AddFormatOption(command, &options->format);
  AddNetworkOptions(command, &options->diagnosis.network);
  command.WhenChosen([=] {
    options->diagnosis.build = invocation->build;
    invocation->body = [options] { return Doctor(*options); };
  });
}

}  // namespace legopt::client
