#pragma once

#include <concepts>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "legopt/types/enum_names.h"

namespace legopt::db {

/// The queries in db/queries, embedded by the build: kJobDetails is job_details.sql. The comment at the top of each
/// file states its rows, parameters and order.
enum class Query {
  kArchivedExperiment,
  kArchivedMethods,
  kArchivedResults,
  kAttemptsOfJob,
  kBenchmarkCellsOfExperiment,
  kClockStoppedCount,
  kDatabaseSummary,
  kDatasetArchive,
  kDatasetOfJob,
  kDatasetProblems,
  kEventsOfJob,
  kExperiment,
  kExperimentCount,
  kExperimentListing,
  kExperimentOfSubmission,
  kExperimentProgress,
  kExperimentStates,
  kExperimentTimes,
  kExportedResultCount,
  kExportedResults,
  kFailureCauses,
  kFurtherStarts,
  kHoldingOfExperiment,
  kInterpolationOfExperiment,
  kJobDetails,
  kJobHeading,
  kJobListing,
  kJobsOfProblems,
  kLatestEvents,
  kLiveEvents,
  kLiveExperiments,
  kLiveFailures,
  kLiveWorkers,
  kMeanCpuTimes,
  kMethodOptions,
  kNewestExperimentOfName,
  kPageJobs,
  kPageSolutions,
  kProblemRanges,
  kProblemsOfExperiment,
  kRepeatableResults,
  kResultOriginsOfExperiment,
  kResultsWithoutVerdict,
  kReusableJobs,
  kReusedResultCount,
  kSolveCells,
  kSolvedByRule,
  kSolvesOfCell,
  kStoredJob,
  kTraceOfJob,
  kTraceOfResult,
  kUnsolvedProblems,
  kUnsolvedWaypointsOfJobs,
  kViewedJob,
  kViolationsOfJob,
  kWaypointsOfJobs,
};

/// Returns all queries, for tests.
std::span<const Query> AllQueries();
/// Returns the contents of the file.
std::string_view FileOf(Query query);

/// Value of a parameter as an SQL literal: a number, a text, the name of an enumerator, or a list for IN (...). Without
/// a value: std::nullopt, false, an empty list.
class QueryValue {
 public:  // NOLINTBEGIN(google-explicit-constructor): parameters are written as pairs of name and value
  QueryValue(std::nullopt_t /*none*/) {}
  template <std::same_as<bool> Flag>  // a template, so that no pointer converts to it
  QueryValue(Flag flag) {
    if (flag) literal_ = "1";
  }
  template <std::integral Integer>
  requires(!std::same_as<Integer, bool>) QueryValue(Integer number) : literal_(std::to_string(number)) {}
  QueryValue(std::string_view text);
  QueryValue(const std::string& text) : QueryValue(std::string_view(text)) {}
  template <NamedEnum Enum>
  QueryValue(Enum value) : QueryValue(std::string_view(ToString(value))) {}
  template <class Value>
  QueryValue(const std::optional<Value>& value) {
    if (value) *this = QueryValue(*value);
  }
  template <class Value>
  QueryValue(const std::vector<Value>& list) {
    for (const Value& value : list) Append(QueryValue(value));
  }

  const std::optional<std::string>& literal() const { return literal_; }  // NOLINTEND(google-explicit-constructor)

 private:
  void Append(const QueryValue& next);
  std::optional<std::string> literal_;
};

struct QueryParameter {
  std::string_view name;  ///< without the colon
  QueryValue value;
};

/// Returns the SQL of a query without comments and with the parameters replaced by their values. A line of the file
/// that ends with "-- if :name" is left out if the parameter has no value; elsewhere a parameter without a value is
/// NULL. Throws std::logic_error if the query does not have the parameter, or needs another one.
std::string Sql(Query query, std::initializer_list<QueryParameter> parameters = {});

}  // namespace legopt::db
