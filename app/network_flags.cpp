#include "app/network_flags.h"

#include "app/command_line.h"

namespace legopt::app {

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

void AddListeningFlags(const Command& command, NetworkFlags* flags) {
  command.AddOption("--group", flags->group, "Multicast group (default 239.255.76.67 or LEGOPT_GROUP)")
      .Group(kNetworkHeading);
  command.AddOption("--port", flags->port, "Control port; port + 1 carries bulk data (default 7667 or LEGOPT_PORT)")
      .Group(kNetworkHeading);
  command
      .AddOption("--key-file", flags->key_file,
                 "Shared key of the deployment, made by 'legopt service keygen' (default LEGOPT_KEY_FILE)")
      .Group(kNetworkHeading);
}

void AddNetworkFlags(const Command& command, NetworkFlags* flags) {
  constexpr int kLargestTtl = 255;
  AddListeningFlags(command, flags);
  command.AddOption("--ttl", flags->ttl, "Network hops of sent packets; 0 keeps them on this machine (default 0)")
      .Check(WholeNumber(0, kLargestTtl))
      .Group(kNetworkHeading);
  command
      .AddFlag("--trust-network", flags->trust_network,
               "Send messages to other machines without a key: any host on the network can control the deployment")
      .Group(kNetworkHeading);
}

}  // namespace legopt::app
