#pragma once

#include <string>

#include "client/report/terminal.h"

namespace legopt::client {

/// Returns the command line of the user's pager: LEGOPT_PAGER, else PAGER, else "less -FRX". Empty (no pager) if the
/// value is empty or "cat".
std::string ChoosePager(const Environment& environment);

/// Passes `text` to `command`, run by the shell with this process's standard output, and waits for its end; LESS is set
/// to FRX if the user has not set it. A pager that ends before reading everything is not an error. Returns false,
/// having shown nothing, if there is no command or it cannot be run. Thread rule: modifies the process's SIGPIPE,
/// SIGINT and SIGQUIT during the call, so no other thread may.
bool ShowInPager(const std::string& text, const std::string& command);

}  // namespace legopt::client
