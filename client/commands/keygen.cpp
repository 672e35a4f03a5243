#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "app/command_line.h"
#include "app/printable.h"
#include "bus/message_key.h"
#include "client/client_error.h"
#include "client/commands/commands.h"

namespace legopt::client {
namespace {

using bus::KeyRole;

struct KeygenOptions {
  std::string file;
  KeyRole role = KeyRole::kOperator;
  std::optional<std::string> from;
};

void DeriveKey(const KeygenOptions& options) {
  const auto key = bus::MessageKey::Load(*options.from);
  const bus::MessageKey* derived = key->ForRole(options.role);
  if (derived == nullptr || derived == key.get()) {
    throw ClientError(ExitCode::kUsage, "--from: \"" + *options.from + "\" holds a " +
                                            std::string(ToString(key->role())) +
                                            "'s key; keys of roles are derived from the full key only");
  }
  derived->WriteFile(options.file);
}

ExitCode Keygen(const KeygenOptions& options) {
  const std::string file = app::Printable(options.file);
  switch (options.role) {
    case KeyRole::kOperator:
      bus::MessageKey::Random()->WriteFile(options.file);
      std::cout << "new key in " << file
                << "; give every server, worker and client a copy (--key-file or LEGOPT_KEY_FILE)\n"
                << "  legopt service keygen FILE --role worker --from " << file
                << ": makes a key for hosts that only solve jobs; --role client: for users who only submit\n";
      return ExitCode::kOk;
    case KeyRole::kWorker:
      DeriveKey(options);
      std::cout << "worker's key in " << file
                << "; its holder can work, and cannot submit, cancel, delete or read results\n";
      return ExitCode::kOk;
    case KeyRole::kClient:
      DeriveKey(options);
      std::cout
          << "client's key in " << file
          << "; its holder can submit and read, and cannot work, hold, release, rank, delete or stop the server\n";
      return ExitCode::kOk;
  }
  return ExitCode::kInternal;
}

}  // namespace

void AddKeygenCommand(const app::Command& program, Invocation* invocation) {
  const auto command =
      program.AddCommand("keygen", "Make the shared key of a deployment, or a derived key with fewer rights");
  const auto options = std::make_shared<KeygenOptions>();
  command.AddOption("FILE", options->file, "File to create; an existing one is never overwritten").Required();
  const auto role = command.AddEnum<KeyRole>("--role", options->role,
                                             "Derive a key from --from: worker (a pool's host) or client (a user)",
                                             app::OneOf({"worker", "client"}));
  const auto from =
      command.AddOption("--from", options->from, "Full key that the key of the role is derived from").ValueName("FILE");
  role.Needs(from);
  from.Needs(role);
  command.WhenChosen([=] { invocation->body = [options] { return Keygen(*options); }; });
}

}  // namespace legopt::client
