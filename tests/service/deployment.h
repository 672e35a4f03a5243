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

/// A deployment of its own for one test: free ports, a fresh folder, real processes, real LCM on this host.
class Deployment {
 public:
  /// Why no deployment can be made here, e.g. no multicast route; empty when it can.
  static std::string Unavailable();

  Deployment();
  ~Deployment();

  /// Besides database, group and port, for servers started from now on.
  void SetServerArguments(std::vector<std::string> arguments) { server_arguments_ = std::move(arguments); }
  /// Starts the server and waits until it serves.
  void StartServer();
  /// SIGKILL, and waits for the end.
  void KillServer();
  client::ChildProcess& server() { return *server_; }

  /// Another server process, on database `database`, at this deployment's port or at `port`.
  std::unique_ptr<client::ChildProcess> ExtraServer(const std::filesystem::path& database,
                                                    std::optional<int> port = {});

  /// Starts a worker: the program, and its arguments besides the network's.
  std::unique_ptr<client::ChildProcess> StartWorker(const std::string& program,
                                                    std::vector<std::string> arguments) const;
  std::unique_ptr<client::ChildProcess> StartStubWorker(std::vector<std::string> arguments = {"--slots", "1"}) const;

  /// Submits; returns the experiment's id.
  std::int64_t Submit(const nlohmann::json& spec, const std::string& submission_id);
  /// Waits until `done` likes the experiment's status object; false after `limit`.
  bool WaitFor(std::int64_t experiment, const std::function<bool(const nlohmann::json&)>& done,
               std::chrono::seconds limit = std::chrono::seconds(50));
  bool WaitUntilDone(std::int64_t experiment);
  /// Waits until so many workers take part; false after a while.
  bool WaitForWorkers(int online);
  /// Waits until at least `count` jobs have ended.
  bool WaitForJobs(std::int64_t experiment, int count);

  /// One SELECT on the live database; rows as text cells joined by '|'.
  std::vector<std::string> Query(const std::string& sql) const;

  client::ServerConnection& connection() { return *connection_; }
  const std::filesystem::path& folder() const { return folder_.path(); }
  std::filesystem::path database() const { return folder_ / "results.sqlite"; }
  int port() const { return port_; }

 private:
  test::TemporaryFolder folder_;  // goes after the server
  int port_ = 0;
  std::vector<std::string> server_arguments_;
  std::unique_ptr<client::ChildProcess> server_;
  std::unique_ptr<client::ServerConnection> connection_;
};

/// An experiment of `jobs` stub jobs (one per problem) of `work_ms` each, on the dataset "stub-d".
nlohmann::json StubSpec(int jobs, int work_ms);

/// Path of a program of this build.
std::filesystem::path Program(const std::string& name);

}  // namespace legopt::service
