#pragma once

#include <string>

#include "client/pool/pool_file.h"
#include "client/pool/pool_script.h"

/// @file
/// Values in the languages of the engines' scripts: one function for each, which all values pass.

namespace legopt::client {

/// Refuses values that no script can hold: control characters (line ends among them), and in the folder of logs what
/// the engine would interpret. Throws InputError naming the field.
void CheckForScript(Engine engine, const PoolFile& pool, const PoolAccess& access);

/// A value as one word of an #SBATCH line: in single quotes where needed, in which sbatch takes a backslash as escape.
std::string SlurmWord(const std::string& value);

/// A literal path at the front of a pattern for --output.
std::string SlurmPatternOf(const std::string& path);

/// A value as one word of a #PBS or #$ line: in quotes where needed. Throws InputError for one with both kinds of
/// quotes or a backslash, as these lines have no escape.
std::string QsubWord(const std::string& value);

/// A value as one of the words between the double quotes of 'arguments' or 'environment' of condor_submit.
std::string CondorWord(const std::string& value);

/// A literal value behind the '=' of a line for condor_submit.
std::string CondorValue(const std::string& value);

}  // namespace legopt::client
