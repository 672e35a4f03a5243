#pragma once

#include <string>

namespace legopt::app {

class Program;

/// Returns the reference of a program's command line in Markdown, made from the definition of its options: its commands
/// by group, each with usage, arguments and options, and at the end the network options, described once. Hidden
/// commands and options are omitted. The text does not depend on the machine.
std::string CommandReference(const Program& program);

}  // namespace legopt::app
