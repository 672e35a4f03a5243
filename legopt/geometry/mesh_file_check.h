#pragma once

#include <string>

namespace legopt {

/// Rejects mesh files that assimp 5.2 cannot handle safely: its readers allocate memory for as many elements as a file
/// announces, and some never terminate on malformed text. Checks only the PLY header, and the counts and numbers of a
/// COLLADA file; the reader may still reject a file that passes.
///
/// Throws InputError with the file, the element and its value. Thread-safe; reads a COLLADA file once.
void CheckMeshFile(const std::string& path);

/// Returns true if assimp would read the file as COLLADA: by its suffix, or by the mark at its start.
bool LooksLikeCollada(const std::string& path);

}  // namespace legopt
