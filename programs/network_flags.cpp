#include "programs/network_flags.h"

#include <CLI/CLI.hpp>

#include "programs/checks.h"

namespace legopt::programs {

bus::LcmOptions NetworkFlags::Resolve() const {
  bus::LcmOptions options = bus::LcmOptions::FromEnvironment();
  if (group) options.group = *group;
  if (port) options.port = *port;
  if (ttl) options.ttl = *ttl;
  if (key_file) options.key_file = *key_file;
  options.trust_network = trust_network;
  options.Validate();
  return options;
}

void AddListeningFlags(CLI::App& app, NetworkFlags* flags) {
  app.add_option("--group", flags->group, "Multicast group (default 239.255.76.67 or LEGOPT_GROUP)")
      ->group(kNetworkHeading);
  app.add_option("--port", flags->port, "Control port; port + 1 carries bulk data (default 7667 or LEGOPT_PORT)")
      ->group(kNetworkHeading);
  app.add_option("--key-file", flags->key_file,
                 "Shared key of the deployment, made by 'legopt keygen' (default LEGOPT_KEY_FILE)")
      ->group(kNetworkHeading);
}

void AddNetworkFlags(CLI::App& app, NetworkFlags* flags) {
  constexpr int kLargestTtl = 255;
  AddListeningFlags(app, flags);
  app.add_option("--ttl", flags->ttl, "Network hops of what we send; 0 stays on this machine (default 0)")
      ->check(WholeNumber(0, kLargestTtl))
      ->group(kNetworkHeading);
  app.add_flag("--trust-network", flags->trust_network,
               "Let messages leave this machine without a key: everybody on the network may command the deployment")
      ->group(kNetworkHeading);
}

}  // namespace legopt::programs
