#pragma once

#include <IpIpoptApplication.hpp>
#include <mutex>

namespace legopt {

/// Held during every Ipopt solve of this process: MUMPS keeps global state.
std::mutex& IpoptMutex();

/// Silent, and deaf to option files in the working directory. Ready for options; initialise it with InitializeQuietly.
Ipopt::SmartPtr<Ipopt::IpoptApplication> MakeQuietIpopt();

/// False when an option was refused.
bool InitializeQuietly(Ipopt::IpoptApplication& application);

}  // namespace legopt
