#include <iostream>
#include <memory>
#include <string>

#include "bus/message_key.h"
#include "client/commands/commands.h"
#include "programs/command_line.h"
#include "programs/printable.h"

namespace legopt::client {
namespace {

ExitCode Keygen(const std::string& file) {
  bus::MessageKey::CreateFile(file);
  std::cout << "new key in " << programs::Printable(file)
            << "; give every server, worker and client a copy (--key-file or LEGOPT_KEY_FILE)\n";
  return ExitCode::kOk;
}

}  // namespace

void AddKeygenCommand(const programs::Command& program, Invocation* invocation) {
  const auto command =
      program.AddCommand("keygen", "Make the shared key of a deployment: a new file that only you may read");
  const auto file = std::make_shared<std::string>();
  command.AddOption("FILE", *file, "File to create; an existing one is never overwritten").Required();
  command.WhenChosen([=] { invocation->body = [file] { return Keygen(*file); }; });
}

}  // namespace legopt::client
