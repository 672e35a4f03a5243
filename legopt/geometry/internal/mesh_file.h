#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "legopt/geometry/internal/mesh.h"

namespace legopt {

/// Rejects mesh files that assimp 5.2 cannot handle safely: its readers allocate memory for as many elements as a file
/// announces, and some never terminate on malformed text. Checks only the PLY header, the counts and numbers of a
/// COLLADA file, and that a glTF file names buffers beside it only; the reader may still reject a file that passes.
/// Rejects web pages and pointers of Git LFS as well.
///
/// Throws InputError with the file, the element and its value. Thread-safe; reads a COLLADA file once.
void CheckMeshFile(const std::string& path);

/// Returns true if assimp would read the file as COLLADA: by its suffix, or by the mark at its start.
bool LooksLikeCollada(const std::string& path);

/// Returns true for the suffixes .gltf and .glb, in upper or lower case.
bool IsGltf(const std::string& path);

/// Returns the rotation that makes z the up axis of a glTF file, in which y is up, or of a COLLADA file, from its
/// `up_axis` (Y_UP: x unchanged, y becomes z; X_UP: x becomes z, y becomes -x). Identity for Z_UP, for files without
/// the element and for other formats. Throws InputError for any other value of the element.
Eigen::Matrix3d RotationToZUp(const std::string& mesh_file);

/// Writes a binary little-endian PLY with float coordinates. If the first byte would be a line end, which assimp
/// misreads, vertices get an additional property `guard`. Throws InputError if the file cannot be written.
void WritePly(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace legopt
