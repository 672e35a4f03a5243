#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/report/listing.h"
#include "legopt/types/collision.h"

/// Naming of methods by users: "SQP", or, if an experiment has several methods of the name, "SQP:multi_starts=10" with
/// the distinguishing properties separated by commas: multi_starts, sample_size, incremental (yes, no), collision, id.
namespace legopt::client {

/// A method of an experiment, with all properties that distinguish methods of the same name.
struct MethodIdentity {
  std::int64_t method_id = 0;
  std::string name;
  std::int64_t multi_starts = 0;
  std::int64_t inner_starts = 0;   ///< internal restarts of an attempt beyond its first start
  std::int64_t sample_size = 100;  ///< percent
  bool incremental = false;
  SceneRepresentation collision = SceneRepresentation::kSolid;
  std::string hash;  ///< hash of all options

  /// Returns whether name and options are equal; also for methods of different databases.
  bool Same(const MethodIdentity& other) const { return name == other.name && hash == other.hash; }
};

/// Reads the method of a row of db/queries/solve_cells.sql.
MethodIdentity MethodAt(const Listing& cells, std::size_t row);

/// Returns the shortest unambiguous name of `method`, which must be one of `methods`.
std::string ChoiceOf(const MethodIdentity& method, std::span<const MethodIdentity> methods);

/// Returns whether `text` has the form of a choice: the name of a method, alone or with known properties.
bool IsMethodChoice(const std::string& text, std::span<const MethodIdentity> methods);

/// Returns all methods named by `text`, ignoring case: "SQP" names every SQP. Throws ClientError (kUsage) for a name
/// with properties that none of its methods has.
std::vector<MethodIdentity> FindMethods(const std::string& text, std::span<const MethodIdentity> methods);

/// Returns the method named by `text`, ignoring case; nullopt if no method has the name. Throws ClientError (kUsage)
/// for a name with wrong properties, and for an ambiguous name: the error lists how to distinguish the methods.
std::optional<MethodIdentity> FindMethod(const std::string& text, std::span<const MethodIdentity> methods);

/// Returns the method named by `text`; if there is none, throws ClientError (kUsage) with the most similar name.
MethodIdentity ChooseMethod(const std::string& text, std::span<const MethodIdentity> methods,
                            std::int64_t experiment_id);

/// Returns "did you mean 'SQP'? valid: ..." for the names of all methods.
std::string SuggestMethod(const std::string& text, std::span<const MethodIdentity> methods);

}  // namespace legopt::client
