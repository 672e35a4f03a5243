#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace legopt {

/// How the mesh files of a URDF are found.
struct MeshSearch {
  std::vector<std::filesystem::path> folders = {};  ///< searched after the URDF's own folder, in this order
  bool allow_missing = false;                       ///< leave meshes out whose files do not exist
};

/// Where the mesh files of a URDF are looked for.
struct MeshPlaces {
  std::filesystem::path folder;  ///< absolute path of the URDF's folder
  MeshSearch search = {};
};

/// A mesh file named by a URDF.
struct FoundMesh {
  std::filesystem::path path;  ///< absolute; an existing file
  std::string fallback;        ///< how the name had to be changed; empty: not at all
};

/// Finds the file that a URDF names. `folder`: absolute path of the URDF's folder.
///
/// In this order: the name itself, relative to the folder; `file://` with a path; `package://NAME/REST` and
/// `model://NAME/REST`: NAME/REST in the folder or one above it. Then, each reported as a fallback: with '\' as '/';
/// with %XX decoded; REST without NAME in the folder or one above it; the last parts of REST there; each of these
/// without regard to case, if exactly one file matches. Returns nullopt if nothing is found.
std::optional<FoundMesh> FindMesh(const std::string& name, const std::filesystem::path& folder);
/// Searches like FindMesh in `folder` and, if that finds nothing, in `more`.
std::optional<FoundMesh> FindMesh(const std::string& name, const std::filesystem::path& folder,
                                  const std::vector<std::filesystem::path>& more);

}  // namespace legopt
