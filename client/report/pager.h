#pragma once

#include <string>

#include "client/report/terminal.h"

namespace legopt::client {

/// The command line of the user's pager: LEGOPT_PAGER, else PAGER, else "less -FRX". Empty: none, which is what an
/// empty value and "cat" mean.
std::string ChoosePager(const Environment& environment);

/// Hands `text` to `command`, run by the shell with our standard output, and waits for its end; LESS is set to FRX
/// where the user has not set it. A pager that ends before it has read everything is no error. False when there is
/// nothing to run or it cannot be run; then nothing was shown. Thread rule: sets the process's SIGPIPE, SIGINT
/// and SIGQUIT meanwhile, so no other thread may.
bool ShowInPager(const std::string& text, const std::string& command);

}  // namespace legopt::client
