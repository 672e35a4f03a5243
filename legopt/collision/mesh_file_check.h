#pragma once

#include <string>

namespace legopt {

/// Refuses mesh files that assimp 5.2 would not survive: its readers take memory for as many elements as a file
/// announces, and some never come to the end of a damaged text. Looks at the PLY header; at the counts and numbers of a
/// COLLADA file; at nothing else. A file that passes may still be refused by the reader.
///
/// Throws InputError that names the file, the element and its value. Thread-safe; reads a COLLADA file once.
void CheckMeshFile(const std::string& path);

/// Whether assimp would read the file as COLLADA: by its suffix, or by the mark at its start.
bool LooksLikeCollada(const std::string& path);

}  // namespace legopt
