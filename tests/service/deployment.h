#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/service/child_process.h"
#include "client/service/server_connection.h"
#include "tests/temporary_folder.h"

namespace legopt::service {

/// A deployment for one test: free ports, a new folder, real processes, real LCM on this host.
class Deployment {
 public:
  /// Returns why no deployment can be made here, e.g. no multicast route; empty if it can.
  static std::string Unavailable();

  Deployment();
  ~Deployment();

  /// Sets arguments of servers started from now on, in addition to database, group and port.
  void SetServerArguments(std::vector<std::string> arguments) { server_arguments_ = std::move(arguments); }
  /// Starts the server and waits until it serves.
  void StartServer();
  /// Sends SIGKILL and waits for the end.
  void KillServer();
  client::ChildProcess& server() { return *server_; }

  /// Starts another server on database `database`, at this deployment's port or at `port`.
  std::unique_ptr<client::ChildProcess> ExtraServer(const std::filesystem::path& database,
                                                    std::optional<int> port = {});

  /// Starts a worker program with arguments in addition to the network's.
  std::unique_ptr<client::ChildProcess> StartWorker(const std::string& program,
                                                    std::vector<std::string> arguments) const;
  std::unique_ptr<client::ChildProcess> StartStubWorker(std::vector<std::string> arguments = {"--slots", "1"}) const;

  /// Submits a specification; returns the experiment's id.
  std::int64_t Submit(const nlohmann::json& spec, const std::string& submission_id);
  /// Waits until `done` accepts the experiment's status object; returns false after `limit`.
  bool WaitFor(std::int64_t experiment, const std::function<bool(const nlohmann::json&)>& done,
               std::chrono::seconds limit = std::chrono::seconds(50));
  bool WaitUntilDone(std::int64_t experiment);
  /// Waits until this number of workers is online; returns false after a while.
  bool WaitForWorkers(int online);
  /// Waits until at least `count` jobs have ended.
  bool WaitForJobs(std::int64_t experiment, int count);

  /// Executes one SELECT on the live database; returns rows as text cells joined by '|'.
  std::vector<std::string> Query(const std::string& sql) const;

  client::ServerConnection& connection() { return *connection_; }
  const std::filesystem::path& folder() const { return folder_.path(); }
  std::filesystem::path database() const { return folder_ / "results.sqlite"; }
  int port() const { return port_; }

 private:
  test::TemporaryFolder folder_;  // removed after the server's end
  int port_ = 0;
  std::vector<std::string> server_arguments_;
  std::unique_ptr<client::ChildProcess> server_;
  std::unique_ptr<client::ServerConnection> connection_;
};

/// Returns an experiment of `jobs` stub jobs (one per problem) of `work_ms` each, on the dataset "stub-d".
nlohmann::json StubSpec(int jobs, int work_ms);

/// Returns the path of a program of this build.
std::filesystem::path Program(const std::string& name);

}  // namespace legopt::service
