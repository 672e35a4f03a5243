#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "legopt/geometry/internal/mesh.h"
#include "legopt/geometry/internal/mesh_bodies.h"

namespace legopt {

/// Options of RepairMesh.
struct MeshRepairOptions {
  double weld_m = 1e-5;  ///< vertices closer than this are merged; also the tolerance of T-junctions, m
  bool close = true;     ///< if true, stitch T-junctions, cap holes and thicken sheets; false: add no surface
  double ground_thickness_m = 0.1;  ///< thickness of ground sheets, downwards, m
  double wall_thickness_m = 0.01;   ///< thickness of all other sheets, m

  /// Throws InputError with the flag that is out of range.
  void Validate() const;
};

/// Origin of a triangle of a repaired mesh.
enum class TriangleOrigin : std::uint8_t {
  kKept,     ///< unchanged up to welding
  kChanged,  ///< turned round, or part of a triangle that was split
  kAdded     ///< cap of a hole, or the second face or rim of a thickened sheet
};

/// Number of repairs of each kind.
struct MeshRepairCounts {
  int welded_vertices = 0;       ///< vertices merged with another one within the tolerance
  int degenerate_triangles = 0;  ///< triangles without area, removed
  int duplicate_triangles = 0;   ///< copies of another triangle, removed
  int inner_triangles = 0;       ///< triangles of walls inside of a body, removed
  int turned_triangles = 0;      ///< triangles turned round, including those of turned bodies
  int turned_bodies = 0;         ///< closed bodies that were wound inside out
  int split_triangles = 0;       ///< triangles split at T-junctions
  int capped_holes = 0;          ///< holes closed by a cap
  int uneven_holes = 0;          ///< holes among them that are not planar: their caps are a guess
  int thickened_ground = 0;      ///< sheets that got a thickness downwards
  int thickened_walls = 0;       ///< other sheets that got a thickness
  int cavities = 0;              ///< closed hollow spaces in bodies, kept
  int added_triangles = 0;       ///< triangles of caps and thickened sheets

  bool none() const;                        ///< true if nothing was repaired
  void Add(const MeshRepairCounts& other);  ///< adds the counts of another mesh
  bool operator==(const MeshRepairCounts&) const = default;
};

/// Name, count and description of each kind of repair, in the order of the steps.
struct MeshRepairEntry {
  const char* name;              ///< key in JSON, e.g. "capped_holes"
  const char* description;       ///< e.g. "holes capped"
  int MeshRepairCounts::*count;  ///< member of the counts
};
/// Returns all kinds of repairs.
const std::vector<MeshRepairEntry>& MeshRepairEntries();

/// Returns the counts that are not zero, as "3 holes capped, 1 sheet thickened".
std::string ToString(const MeshRepairCounts& counts);

/// Result of RepairMesh.
struct RepairedMesh {
  TriangleMesh mesh;
  std::vector<TriangleOrigin> origins;  ///< parallel to the triangles
  MeshRepairCounts counts;
  MeshFaults faults;       ///< faults that remain
  double volume_m3 = 0.0;  ///< sum over closed bodies, without their cavities; bodies may overlap
};

/// Returns the volume that the closed components (mesh_bodies.h) of a mesh enclose, m^3. Inverted components count
/// negatively.
double EnclosedVolume(const TriangleMesh& mesh);

/// Returns the number of triangles that have the same three corners in the same winding as an earlier triangle.
int CountDuplicates(const TriangleMesh& mesh);

/// Returns the number of closed components without volume, such as sheets with two faces.
int CountFlatBodies(const TriangleMesh& mesh);

/// Repairs a mesh so that it bounds solids, as far as possible:
///
///  1. Vertices are rounded to float, in which meshes are stored, and welded within `weld_m`.
///  2. Duplicates and triangles without area are removed. Without `close`, a triangle without area stays if the
///     surface is closed only with it.
///  3. Open edges are split at vertices on them (T-junctions), with `close` only.
///  4. Triangles get the winding of their neighbours. Closed bodies are turned outwards; a body inside of another one,
///     with opposite winding, is a cavity and keeps it.
///  5. With `close`, planar holes get a cap, and small holes that are nearly planar. A planar component, or one whose
///     cap would lie on its own surface, is a sheet: ground (mostly level) gets a thickness downwards, to a flat floor
///     if it has risers; other sheets get half the thickness on both sides. A vessel open at the top whose faces look
///     inwards (a room) gets its thickness outwards.
///
/// Deterministic. Throws InputError for options out of range. Thread-safe.
RepairedMesh RepairMesh(const TriangleMesh& source, const MeshRepairOptions& options);

}  // namespace legopt
