#include "client/commands/commands.h"

int main(int argc, char** argv) { return legopt::client::RunCommandLine(argc, argv); }
