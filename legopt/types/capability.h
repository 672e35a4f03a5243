#pragma once

#include <cstdint>

#include "legopt/types/enum_names.h"

namespace legopt {

/// Kinds of capabilities that a worker announces by name and hash and that jobs may require.
enum class CapabilityKind : std::uint8_t {
  kDataset,    ///< name and content hash
  kSolver,     ///< external solver: name, and hash of its declaration and files
  kCollision,  ///< collision model (SceneRepresentation): its enum name; no hash
  kFetch,      ///< the worker can fetch missing datasets from the server; no name, no hash
  kUnfetched,  ///< content hash of a dataset that the worker tried to fetch and cannot use
};

template <>
inline constexpr auto kEnumNames<CapabilityKind> =
    MakeEnumNames<CapabilityKind>({{CapabilityKind::kDataset, "dataset"},
                                   {CapabilityKind::kSolver, "solver"},
                                   {CapabilityKind::kCollision, "collision"},
                                   {CapabilityKind::kFetch, "fetch"},
                                   {CapabilityKind::kUnfetched, "unfetched"}});

}  // namespace legopt
