#include "client/commands/new_database.h"

#include <cstdint>
#include <exception>
#include <system_error>

#include "client/report/result_source.h"
#include "db/lock_file.h"
#include "db/named_queries.h"
#include "legopt/files/written_file.h"

namespace legopt::client {
namespace {

bool HoldsExperiments(const std::filesystem::path& file) {
  try {
    const auto source = OpenResults({file.string(), {}});
    return source->Query(db::Sql(db::Query::kExperimentCount)).At(0, "n").get<std::int64_t>() > 0;
  } catch (const std::exception&) {
    return false;  // no database was created
  }
}

}  // namespace

NewDatabase::NewDatabase(const std::optional<std::string>& named, const std::string& stem)
    : path_(named.value_or(stem + ".sqlite")) {
  std::error_code error;
  if (named) {
    // The server reports a missing or unwritable folder.
    created_ = !std::filesystem::exists(path_, error) && !error;
    return;
  }
  for (int i = 2; !files::ReserveFileName(path_); ++i) path_ = stem + "-" + std::to_string(i) + ".sqlite";
  created_ = true;
}

NewDatabase::~NewDatabase() {
  std::error_code error;
  if (!created_ || !std::filesystem::exists(path_, error)) return;
  try {
    const db::LockFile lock(path_);
    if (HoldsExperiments(path_)) return;
    for (const char* suffix : {"", "-wal", "-shm", "-journal"}) std::filesystem::remove(path_.string() + suffix, error);
  } catch (const std::exception&) {
    return;  // a server uses it
  }
}

}  // namespace legopt::client
