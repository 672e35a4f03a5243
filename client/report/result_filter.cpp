#include "client/report/result_filter.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <string>
#include <string_view>

#include "app/command_line.h"
#include "app/value_list.h"
#include "client/client_error.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/types/nearest_name.h"

namespace legopt::client {
namespace {

constexpr char kMethods[] = "--methods", kTasks[] = "--tasks", kInitializations[] = "--initializations",
               kMultiStarts[] = "--multi-starts", kSampleSize[] = "--sample-size", kCollision[] = "--collision";

// One option of a filter with its values.
struct Criterion {
  std::string flag;
  std::string noun;  // name of a value in errors
  std::vector<std::string> values;
  std::function<std::string(const FilteredItem&)> text;  // value of an item, as users write it
};

std::vector<std::string> TextsOf(const std::optional<std::int64_t>& number) {
  return number ? std::vector{std::to_string(*number)} : std::vector<std::string>{};
}

std::vector<std::string> TextsOf(const std::optional<SceneRepresentation>& model) {
  return model ? std::vector{std::string(ToString(*model))} : std::vector<std::string>{};
}

// Returns the options except --methods, in the order in which they are applied.
std::vector<Criterion> CriteriaOf(const ResultFilter& filter) {
  const auto method = [](auto text_of) {
    return [text_of](const FilteredItem& item) { return std::string(text_of(item.method)); };
  };
  return {{kMultiStarts, "method", TextsOf(filter.multi_starts),
           method([](const MethodIdentity& m) { return std::to_string(m.multi_starts); })},
          {kSampleSize, "method", TextsOf(filter.sample_size),
           method([](const MethodIdentity& m) { return std::to_string(m.sample_size); })},
          {kCollision, "method", TextsOf(filter.collision),
           method([](const MethodIdentity& m) { return ToString(m.collision); })},
          {kTasks, "task", filter.tasks, [](const FilteredItem& item) { return item.task; }},
          {kInitializations, "initialization", filter.initializations,
           [](const FilteredItem& item) { return item.initialization; }}};
}

// The items that the options applied so far keep. Options are applied one by one, so that an error names the option
// without matches and the values remaining at that point.
class RemainingItems {
 public:
  RemainingItems(const std::vector<FilteredItem>& items, std::string owner)
      : items_(items), owner_(std::move(owner)), kept_(items.size()) {
    std::iota(kept_.begin(), kept_.end(), std::size_t{0});
  }

  void ApplyMethods(const std::vector<std::string>& lists) {
    const std::vector<MethodIdentity> methods = Methods();
    const auto is_choice = [&](const std::string& text) { return IsMethodChoice(text, methods); };
    std::set<std::int64_t> ids;
    std::vector<std::string> values;
    for (const std::string& list : lists) {
      for (const std::string& value : app::SplitValues(list, is_choice)) {
        const std::vector<MethodIdentity> found = FindMethods(value, methods);
        if (found.empty()) Refuse(kMethods, "method", value, Known([](const auto& item) { return item.method.name; }));
        for (const MethodIdentity& method : found) ids.insert(method.method_id);
        values.push_back(value);
      }
    }
    if (values.empty()) return;
    std::erase_if(kept_, [&](std::size_t i) { return !ids.contains(items_[i].method.method_id); });
    Record(kMethods, values);
  }

  void Apply(const Criterion& criterion) {
    if (criterion.values.empty()) return;
    const std::vector<std::string> known = Known(criterion.text);
    for (const std::string& value : criterion.values) {
      if (std::ranges::find(known, value) == known.end()) Refuse(criterion.flag, criterion.noun, value, known);
    }
    std::erase_if(kept_, [&](std::size_t i) {
      return std::ranges::find(criterion.values, criterion.text(items_[i])) == criterion.values.end();
    });
    Record(criterion.flag, criterion.values);
  }

  const std::vector<std::size_t>& kept() const { return kept_; }

 private:
  std::vector<MethodIdentity> Methods() const {
    std::vector<MethodIdentity> methods;
    for (const std::size_t i : kept_) {
      const MethodIdentity& method = items_[i].method;
      if (std::ranges::find(methods, method.method_id, &MethodIdentity::method_id) == methods.end()) {
        methods.push_back(method);
      }
    }
    return methods;
  }

  template <class TextOf>
  std::vector<std::string> Known(const TextOf& text_of) const {
    std::vector<std::string> known;
    for (const std::size_t i : kept_) {
      const std::string text = text_of(items_[i]);
      if (!text.empty() && std::ranges::find(known, text) == known.end()) known.push_back(text);
    }
    return known;
  }

  [[noreturn]] void Refuse(const std::string& flag, const std::string& noun, const std::string& value,
                           const std::vector<std::string>& known) const {
    throw ClientError(ExitCode::kUsage, flag + " " + value + ": " + owner_ + " has no such " + noun + so_far_ +
                                            (known.empty() ? "" : "; " + SuggestName(value, known)));
  }

  void Record(const std::string& flag, const std::vector<std::string>& values) {
    so_far_ += (so_far_.empty() ? " among those of " : ", ") + flag + " " + app::Joined(values);
  }

  const std::vector<FilteredItem>& items_;
  std::string owner_;
  std::vector<std::size_t> kept_;
  std::string so_far_;  // the options applied so far, for errors
};

}  // namespace

bool ResultFilter::empty() const {
  return methods.empty() && tasks.empty() && initializations.empty() && !multi_starts && !sample_size && !collision;
}

void AddNameFilterOptions(const app::Command& command, ResultFilter* filter) {
  using app::EnumNamesOf, app::Joined, app::OneOf;
  // Split later, when the methods are known: a name may contain a comma.
  command
      .AddOption("--methods,--method", filter->methods,
                 "Only these methods: names, or SQP:multi_starts=10 to distinguish methods of one name")
      .OneArgumentEach();
  command.AddList("--tasks,--task", filter->tasks, "Only these tasks: " + Joined(EnumNamesOf<Task>()), {},
                  OneOf(EnumNamesOf<Task>()));
  command.AddList("--initializations,--initialization", filter->initializations,
                  "Only these initial guesses: " + Joined(EnumNamesOf<Initialization>()), {},
                  OneOf(EnumNamesOf<Initialization>()));
}

void AddResultFilterOptions(const app::Command& command, ResultFilter* filter) {
  using app::Alternatives, app::EnumNamesOf;
  constexpr std::int64_t kMost = 1'000'000;
  AddNameFilterOptions(command, filter);
  command.AddOption(kMultiStarts, filter->multi_starts, "Only methods with this number of restarts")
      .Check(app::WholeNumber(0, kMost));
  command.AddOption(kSampleSize, filter->sample_size, "Only methods with this sample size, in percent")
      .Check(app::WholeNumber(1, 100));
  command.AddEnum<SceneRepresentation>(
      kCollision, filter->collision,
      "Only methods with this model: " + Alternatives(EnumNamesOf<SceneRepresentation>()));
}

std::string Describe(const ResultFilter& filter) {
  std::string text;
  const auto add = [&](const std::string& flag, const std::vector<std::string>& values) {
    if (!values.empty()) text += (text.empty() ? "" : " ") + flag + " " + app::Joined(values);
  };
  add(kMethods, filter.methods);
  for (const Criterion& criterion : CriteriaOf(filter)) add(criterion.flag, criterion.values);
  return text;
}

std::vector<std::size_t> KeptItems(const std::vector<FilteredItem>& items, const ResultFilter& filter,
                                   const std::string& owner) {
  RemainingItems remaining(items, owner);
  remaining.ApplyMethods(filter.methods);
  for (const Criterion& criterion : CriteriaOf(filter)) remaining.Apply(criterion);
  return remaining.kept();
}

KeptCells::KeptCells(ResultSource& source, std::int64_t experiment_id, const ResultFilter& filter)
    : all_(filter.empty()) {
  if (all_) return;
  const Listing cells = source.Query(db::Sql(db::Query::kSolveCells, {{"experiment_id", experiment_id}}));
  std::vector<FilteredItem> items;
  for (std::size_t i = 0; i < cells.rows.size(); ++i) {
    items.push_back({MethodAt(cells, i), cells.Text(i, "task"), cells.Text(i, "initialization")});
  }
  for (const std::size_t i : KeptItems(items, filter, "experiment " + std::to_string(experiment_id))) {
    num_jobs_ += cells.At(i, "num_jobs").get<std::int64_t>();
    ids_.push_back(cells.At(i, "cell_id").get<std::int64_t>());
    cells_.insert({items[i].method.method_id,
                   {cells.EnumAt<Task>(i, "task"), cells.EnumAt<Initialization>(i, "initialization")}});
  }
}

std::vector<std::string> DistinguishingColumns(ResultSource& source, std::int64_t experiment_id) {
  const Listing cells = source.Query(db::Sql(db::Query::kSolveCells, {{"experiment_id", experiment_id}}));
  std::vector<std::string> columns;
  for (const char* column : {"multi_starts", "sample_size", "incremental", "collision"}) {
    std::set<std::string> names;
    std::set<std::pair<std::string, std::string>> values;
    for (std::size_t i = 0; i < cells.rows.size(); ++i) {
      names.insert(cells.Text(i, "name"));
      values.insert({cells.Text(i, "name"), Dump(cells.At(i, column))});
    }
    if (values.size() > names.size()) columns.emplace_back(column);
  }
  return columns;
}

namespace {

// Returns e.g. "experiment 3 with --methods SQP --problem 4".
std::string Described(const JobChoice& choice, std::int64_t experiment_id) {
  std::string options = Describe(choice.filter);
  if (choice.problem) options += (options.empty() ? "" : " ") + ("--problem " + std::to_string(*choice.problem));
  return "experiment " + std::to_string(experiment_id) + (options.empty() ? "" : " with " + options);
}

}  // namespace

void AddJobChoiceOptions(const app::Command& command, JobChoice* choice) {
  command
      .AddOption("--experiment", choice->experiment,
                 "Choose the job from this experiment by the options below (default: the newest)")
      .Check(app::WholeNumber(1));
  AddResultFilterOptions(command, &choice->filter);
}

std::int64_t ChooseJob(ResultSource& source, const JobChoice& choice) {
  constexpr int kMostNamed = 5;
  const ExperimentInfo experiment = FindExperiment(source, choice.experiment);
  const KeptCells kept(source, experiment.id, choice.filter);
  const Listing jobs = source.Query(db::Sql(db::Query::kJobListing, {{"experiment_id", experiment.id},
                                                                     {"rule", experiment.rule},
                                                                     {"cell_ids", kept.ids()},
                                                                     {"problem_id", choice.problem}}),
                                    kMostNamed);
  if (jobs.rows.size() == 1) return jobs.At(0, "job").get<std::int64_t>();
  const std::string described = Described(choice, experiment.id);
  if (jobs.rows.empty()) throw ClientError(ExitCode::kUsage, "there is no job of " + described);
  std::string numbers;
  for (std::size_t i = 0; i < jobs.rows.size(); ++i) numbers += (i == 0 ? "" : ", ") + Dump(jobs.At(i, "job"));
  throw ClientError(ExitCode::kUsage, "there are several jobs of " + described + ": " + numbers +
                                          (jobs.truncated ? ", ..." : "") +
                                          "; name one of them, or add --problem, --methods, --tasks or "
                                          "--initializations");
}

}  // namespace legopt::client
