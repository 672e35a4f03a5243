#pragma once

#include <stdexcept>
#include <string>

#include "app/exit_codes.h"

namespace legopt::client {

using app::ExitCode;

/// Error that ends a command. `what()` is one line with the cause and the remedy; `main` prints it as
/// "legopt: error: ..." and exits with `code()`.
class ClientError : public std::runtime_error {
 public:
  ClientError(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

}  // namespace legopt::client
