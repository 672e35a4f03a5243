#include "client/benchmark/site.h"

#include <algorithm>
#include <exception>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <utility>

#include "client/archive/archive_database.h"
#include "client/archive/archive_dataset.h"
#include "client/archive/archive_file.h"
#include "client/archive/archive_judge.h"
#include "client/benchmark/leaderboard.h"
#include "client/benchmark/site_folder.h"
#include "client/client_error.h"
#include "client/page/page.h"
#include "client/page/page_dataset.h"
#include "client/page/page_file.h"
#include "client/report/escaped_text.h"
#include "client/report/output.h"
#include "client/report/result_dataset.h"
#include "client/report/table_writers.h"
#include "legopt/files/temporary_folder.h"
#include "legopt/input/text.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A folder for temporary files, removed at the end.
class ScratchFolder {
 public:
  ScratchFolder() : path_(files::CreateTemporaryFolder("legopt-site-")) {}
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// Names of files in `archives/`: those of the archives, with a number if two have the same.
std::string FreeName(const fs::path& file, std::set<std::string>* used) {
  const std::string stem = file.stem().string();
  std::string name = stem;
  for (int i = 2; !used->insert(name).second; ++i) name = stem + "-" + std::to_string(i);
  return name;
}

// `bytes`: content of the file.
Entry ReadEntry(const fs::path& file, const std::string& bytes, const SiteRequest& request,
                const std::set<std::string>& known) {
  Entry entry;
  entry.archive = DecodeArchive(bytes, file.string());
  if (known.count(entry.archive.hash) > 0) {
    throw ClientError(ExitCode::kUsage, "has the content of another archive of this site");
  }
  entry.dataset = FindArchivedDataset(entry.archive, request.datasets, DatasetUse::kAlsoLocal);
  if (request.tell) {
    request.tell(file.filename().string() + ": judging " + std::to_string(entry.archive.results.size()) + " results");
  }
  entry.judged = JudgeArchive(entry.archive, entry.dataset);
  return entry;
}

// The rule of the tier that has the archive's problems, so that its page counts like the leaderboard; else its own.
Rule RuleOf(const Archive& archive, const Benchmark& benchmark) {
  for (const BenchmarkTier& tier : benchmark.tiers) {
    for (const BenchmarkSet& set : tier.sets) {
      if (set.hash == archive.dataset_hash) return tier.rule;
    }
  }
  return archive.rule;
}

// Writes the page, the judgement and the archive, of which `bytes` were read, and drops what leaderboards do not need.
void WriteEntry(const std::string& bytes, const SiteRequest& request, SiteFolder* folder, Entry* entry) {
  const ScratchFolder scratch;
  const fs::path database = scratch.path() / "results.sqlite";
  ArchiveDatabase writer;
  writer.Add(entry->archive, entry->judged, *entry->dataset);
  writer.Finish(database);
  ReportRequest report;
  report.sources = {{{database.string(), {}, {}}, 1}};
  report.rule = RuleOf(entry->archive, request.benchmark);
  report.datasets = {entry->dataset};
  report.build = request.build;
  report.most_bytes = request.most_page_bytes;
  report.home = "../index.html";
  const std::string page = MakeReport(report).text;
  const std::string stem = "archives/" + entry->name;
  folder->Write(stem + ".html", page);
  folder->Write(stem + ".judged.json", JsonText(JudgementJson(entry->archive, entry->judged)) + "\n");
  folder->Write(stem + ".legopt-archive", bytes);
  for (ArchivedResult& result : entry->archive.results) result.waypoints.clear();
  for (JudgedResult& judged : entry->judged.results) judged.evaluation.reset();
}

// The reason of an error without paths of this machine, which are not for others.
std::string PublicReason(const InputError& error) {
  InputError::Fault fault = error.fault();
  fault.file.clear();
  return InputError::TextOf(fault);
}

Json AboutJson(const Entry& entry) {
  const Archive& archive = entry.archive;
  Json builds = Json::array();
  for (const ArchivedBuild& build : archive.builds) {
    builds.push_back({{"id", build.id}, {"text", build.text}, {"processor", build.processor}});
  }
  return {{"name", entry.name},
          {"hash", archive.hash},
          {"title", archive.about.title},
          {"authors", archive.about.authors},
          {"paper", archive.about.paper},
          {"licence", archive.about.licence},
          {"code", archive.about.code},
          {"notes", archive.about.notes},
          {"experiment", archive.experiment},
          {"dataset", archive.dataset},
          {"dataset_hash", archive.dataset_hash},
          {"seed", archive.seed},
          {"repetitions", archive.repetitions},
          {"jobs", archive.num_jobs()},
          {"results", archive.results.size()},
          {"differing", entry.judged.differing},
          {"builds", std::move(builds)}};
}

Json TiersJson(const Benchmark& benchmark) {
  Json tiers = Json::array();
  for (const BenchmarkTier& tier : benchmark.tiers) {
    tiers.push_back({{"id", tier.id},
                     {"title", tier.title},
                     {"question", tier.question},
                     {"rule", ToString(tier.rule)},
                     {"infeasible", tier.infeasible}});
  }
  return tiers;
}

std::string IndexPage(const SiteRequest& request, const std::vector<Entry>& entries, const std::vector<Board>& boards,
                      const std::vector<RefusedArchive>& refused) {
  const Benchmark& benchmark = request.benchmark;
  Json root = PageHead("site", benchmark.name, request.build);
  root["notes"] = Json::array();
  for (const RefusedArchive& archive : refused) {
    root["notes"].push_back(archive.file + " is left out: " + archive.reason);
  }
  root["site"] = {{"edition", benchmark.edition},
                  {"about", benchmark.about},
                  {"tiers", TiersJson(benchmark)},
                  {"entries", Json::array()},
                  {"boards", BoardsJson(benchmark, entries, boards)}};
  for (const Entry& entry : entries) root["site"]["entries"].push_back(AboutJson(entry));
  root["datasets"] = Json::array();
  root["chunks"] = Json::array();
  PageFile file(benchmark.name);
  file.AddJson("page", root);
  return file.Finish();
}

// The datasets of all entries and tiers that are on this machine, each once.
std::vector<std::shared_ptr<const Dataset>> ShownDatasets(const SiteRequest& request,
                                                          const std::vector<Entry>& entries) {
  std::map<std::string, std::shared_ptr<const Dataset>> datasets;  // key: content hash
  for (const auto& dataset : request.datasets) datasets[dataset->content_hash()] = dataset;
  for (const Entry& entry : entries) datasets[entry.archive.dataset_hash] = entry.dataset;
  for (const BenchmarkTier& tier : request.benchmark.tiers) {
    for (const BenchmarkSet& set : tier.sets) {
      if (datasets.count(set.hash) > 0) continue;
      if (auto found = FindLocalDataset(set.hash)) datasets[set.hash] = std::move(found);
    }
  }
  std::vector<std::shared_ptr<const Dataset>> shown;
  for (auto& [hash, dataset] : datasets) shown.push_back(dataset);
  std::ranges::sort(shown, {}, [](const auto& dataset) { return dataset->name(); });
  return shown;
}

// A page that opens archives and databases, with the geometry of known datasets.
std::string ViewerPage(const SiteRequest& request, const std::vector<Entry>& entries) {
  Json root = PageHead("viewer", request.benchmark.name, request.build);
  root["home"] = "index.html";
  root["notes"] = Json::array();
  root["chunks"] = Json::array();
  root["datasets"] = Json::array();
  PageFile file(request.benchmark.name + ": open a file", PageKind::kOpener);
  for (const auto& dataset : ShownDatasets(request, entries)) {
    ProblemIds problems;
    for (const TaskDescription& task : kTasks) {
      for (const ProblemDefinition& problem : dataset->problems(task.task)) problems[task.task].insert(problem.id);
    }
    const std::string block = "geometry-" + dataset->content_hash();
    PageDataset described = DescribeDataset(*dataset, problems, block);
    root["datasets"].push_back(std::move(described.json));
    file.AddBlock(block, described.geometry);
  }
  file.AddJson("page", root);
  return file.Finish();
}

}  // namespace

std::vector<RefusedArchive> WriteSite(const SiteRequest& request) {
  SiteFolder folder(request.out);
  std::vector<Entry> entries;
  std::vector<RefusedArchive> refused;
  std::set<std::string> names, hashes;
  for (const fs::path& file : request.archives) {
    const auto refuse = [&](const std::string& reason) { refused.push_back({file.filename().string(), reason}); };
    // Archives come from strangers: no fault of one may prevent the site of the others.
    try {
      const std::string bytes = ReadFileText(file, kMaxArchiveBytes);
      Entry entry = ReadEntry(file, bytes, request, hashes);
      entry.name = FreeName(file, &names);
      WriteEntry(bytes, request, &folder, &entry);
      hashes.insert(entry.archive.hash);
      entries.push_back(std::move(entry));
    } catch (const InputError& error) {
      refuse(PublicReason(error));
    } catch (const ClientError& error) {
      refuse(error.what());
    } catch (const std::exception& error) {
      if (request.tell) request.tell(file.filename().string() + ": " + error.what());
      refuse("it cannot be stored as a results database");
    }
  }
  if (entries.empty()) return refused;
  const std::vector<Board> boards = MakeBoards(request.benchmark, entries);
  folder.Write("index.html", IndexPage(request, entries, boards, refused));
  folder.Write("viewer.html", ViewerPage(request, entries));
  folder.Write("leaderboard.csv", RenderTable(BoardsTable(request.benchmark, entries, boards), TableFormat::kCsv));
  folder.Finish();
  return refused;
}

}  // namespace legopt::client
