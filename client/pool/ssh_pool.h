#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/client_error.h"
#include "client/pool/pool_file.h"
#include "client/pool/pool_script.h"
#include "client/service/child_process.h"
#include "programs/processes.h"

namespace legopt::client {

/// Workers on hosts that ssh reaches, one each. A worker lives as long as its connection: it is told to stop by what
/// comes over that, and by its end, so that none is left behind however this process ends. What ssh says of a worker is
/// for people; whether its jobs are lost is the server's to say, by leases. Thread rule: the thread that makes it lives
/// as long.
class SshPool {
 public:
  /// How a host's worker stands.
  struct Host {
    std::string name;
    std::string state;                            ///< "connected", or how it ended
    std::chrono::system_clock::time_point since;  ///< of that state
  };

  /// Starts them all. Each writes to `access.logs`/HOST.log. Throws ClientError: kMachine when there is no ssh.
  SshPool(const PoolFile& pool, const PoolAccess& access);

  /// To be called a few times per second: true when a worker has ended since the last call.
  bool Look();
  bool over() const;
  std::vector<Host> hosts() const;

  /// One order to stop to each worker: the first lets running jobs end within `drain_s`, the second gives them back.
  void OrderToStop();
  /// Ends the connections, and with them the workers.
  void Close();

  /// Of all that failed, why; empty when none did. To be called when it is over.
  struct Failure {
    ExitCode code;
    std::string text;
  };
  std::vector<Failure> Failures() const;

 private:
  struct Connection {
    std::string name;
    std::filesystem::path log;
    programs::Descriptor orders;  ///< the worker's standard input
    std::unique_ptr<ChildProcess> ssh;
    std::optional<ChildExit> exit = {};
    bool closed = false;  ///< by Close()
    std::chrono::system_clock::time_point since = {};
  };

  static std::string StateOf(const Connection& connection);

  Connection Connect(const PoolFile& pool, const PoolAccess& access, const std::string& host) const;

  std::vector<Connection> connections_;
};

/// What ssh is called with for a host: patience with hosts that do not answer, and the options of the pool file.
std::vector<std::string> SshArguments(const PoolFile& pool, const std::string& host);

}  // namespace legopt::client
