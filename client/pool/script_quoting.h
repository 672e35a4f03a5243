#pragma once

#include <string>

#include "client/pool/pool_file.h"
#include "client/pool/pool_script.h"

/// @file
/// Quoting of values for batch scripts: one function per syntax, used for all values.

namespace legopt::client {

/// Refuses values that no script can contain: control characters (including line breaks) and, in the log folder,
/// characters that the batch system interprets. Throws InputError naming the field.
void CheckForScript(Engine engine, const PoolFile& pool, const PoolAccess& access);

/// Quotes a value as one word of an #SBATCH line: in single quotes if needed, with backslash escapes as in sbatch.
std::string SlurmWord(const std::string& value);

/// Escapes a literal path at the start of a pattern for --output.
std::string SlurmPatternOf(const std::string& path);

/// Quotes a value as one word of a #PBS or #$ line if needed. Throws InputError for a value that contains both kinds of
/// quotes or a backslash, because these lines have no escape character.
std::string QsubWord(const std::string& value);

/// Quotes a value as one word inside the double quotes of 'arguments' or 'environment' of condor_submit.
std::string CondorWord(const std::string& value);

/// Escapes a literal value after the '=' of a line for condor_submit.
std::string CondorValue(const std::string& value);

}  // namespace legopt::client
