#include "client/commands/archive.h"

#include <iostream>
#include <memory>
#include <optional>

#include "app/command_line.h"
#include "app/folder_cache.h"
#include "app/printable.h"
#include "client/archive/archive_database.h"
#include "client/archive/archive_dataset.h"
#include "client/archive/archive_file.h"
#include "client/archive/archive_judge.h"
#include "client/archive/archive_pack.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/escaped_text.h"
#include "client/report/reading.h"
#include "client/suite/input_files.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {
namespace {

struct ArchivePackOptions {
  std::optional<std::int64_t> experiment;
  std::optional<std::filesystem::path> about;
  std::filesystem::path out;
  SourceOptions source;
};

struct ArchiveJudgeOptions {
  std::filesystem::path file;
  std::vector<std::string> datasets;
  std::optional<std::filesystem::path> out;
  ListingOptions listing;
};

struct ArchiveUnpackOptions {
  std::vector<std::string> files, datasets;
  std::filesystem::path out;
};

std::string DescriptionOf(const Archive& archive) {
  return "experiment '" + archive.experiment + "', dataset " + archive.dataset + " (" +
         archive.dataset_hash.substr(0, 12) + "), " + std::to_string(archive.methods.size()) +
         (archive.methods.size() == 1 ? " method, " : " methods, ") + std::to_string(archive.results.size()) + " of " +
         std::to_string(archive.num_jobs()) + " jobs with a result";
}

// Warns about missing statements that a published archive should have.
void WarnAboutMissing(const Archive& archive) {
  const ArchiveAbout& about = archive.about;
  std::string missing;
  const auto look = [&](bool absent, const char* what) {
    if (absent) missing += (missing.empty() ? "" : ", ") + std::string(what);
  };
  look(about.authors.empty(), "authors");
  look(about.licence.empty(), "licence");
  look(about.code.empty(), "code");
  if (missing.empty()) return;
  std::cerr << "legopt: warning: the archive does not state: " << missing
            << "; a published one should ('--about FILE')\n";
}

ExitCode PackArchive(const ArchivePackOptions& options) {
  const auto source = OpenResults(options.source);
  const ArchiveAbout about = options.about ? ReadAbout(InputFile(options.about->string())) : ArchiveAbout{};
  const Archive archive = PackExperiment(*source, options.experiment, about);
  ReplaceFile(options.out, EncodeArchive(archive));
  WarnAboutMissing(archive);
  std::cout << app::Printable(options.out.string() + ": " + DescriptionOf(archive)) << "\n";
  return ExitCode::kOk;
}

ExitCode CheckArchive(const std::filesystem::path& file) {
  const Archive archive = ReadArchive(file);
  WarnAboutMissing(archive);
  std::cout << app::Printable(file.string() + ": " + DescriptionOf(archive)) << "\n";
  std::cout << "hash " << archive.hash << "\n";
  const ArchiveAbout& about = archive.about;
  std::string authors;
  for (const std::string& author : about.authors) authors += (authors.empty() ? "" : ", ") + author;
  for (const auto& [key, text] :
       {std::pair("title", about.title), std::pair("authors", authors), std::pair("paper", about.paper),
        std::pair("licence", about.licence), std::pair("code", about.code), std::pair("notes", about.notes)}) {
    if (!text.empty()) std::cout << key << " " << app::Printable(text) << "\n";
  }
  for (const ArchivedBuild& build : archive.builds) {
    std::cout << app::Printable("build " + build.id + " (" + build.text + ") on " + build.processor) << "\n";
  }
  return ExitCode::kOk;
}

// An archive, its dataset and its judgement.
struct JudgedFile {
  Archive archive;
  std::shared_ptr<const Dataset> dataset;
  JudgedArchive judged;
};

JudgedFile ReadAndJudge(const std::filesystem::path& file, const std::vector<std::shared_ptr<const Dataset>>& datasets,
                        DatasetUse use) {
  JudgedFile read;
  read.archive = ReadArchive(file);
  read.dataset = FindArchivedDataset(read.archive, datasets, use);
  std::cerr << app::Printable(file.string()) << ": judging " << read.archive.results.size() << " results\n";
  read.judged = JudgeArchive(read.archive, read.dataset);
  return read;
}

std::string DifferenceOf(const std::filesystem::path& file, const JudgedFile& read) {
  return file.string() + ": " + std::to_string(read.judged.differing) + " of " +
         std::to_string(read.archive.results.size()) + " results have another verdict or cost than the archive states";
}

ExitCode JudgeArchiveAgain(const ArchiveJudgeOptions& options) {
  const JudgedFile read = ReadAndJudge(options.file, LoadArchiveDatasets(options.datasets), DatasetUse::kOnlyGiven);
  if (options.out) ReplaceFile(*options.out, JsonText(JudgementJson(read.archive, read.judged)) + "\n");
  PrintTable(JudgementTable(read.archive, read.judged), options.listing);
  if (read.judged.differing == 0) return ExitCode::kOk;
  throw ClientError(ExitCode::kOtherResult, DifferenceOf(options.file, read));
}

ExitCode UnpackArchives(const ArchiveUnpackOptions& options) {
  if (std::filesystem::exists(options.out)) {
    throw ClientError(ExitCode::kUsage, options.out.string() + " exists; name a new file");
  }
  const auto datasets = LoadArchiveDatasets(options.datasets);
  ArchiveDatabase database;
  for (const std::string& file : options.files) {
    const JudgedFile read = ReadAndJudge(file, datasets, DatasetUse::kAlsoLocal);
    if (read.judged.differing > 0)
      PrintRemark("warning: " + DifferenceOf(file, read) + "; the database has the judgement");
    const std::int64_t id = database.Add(read.archive, read.judged, *read.dataset);
    std::cout << app::Printable(file + ": experiment " + std::to_string(id) + " '" + read.archive.experiment + "'")
              << "\n";
  }
  database.Finish(options.out);
  return ExitCode::kOk;
}

}  // namespace

void AddArchiveDatasetOption(const app::Command& command, std::vector<std::string>* folders) {
  command.AddList("--dataset", *folders,
                  "Dataset folder (default: the one with the archive's hash in the data folder, submitted or fetched); "
                  "several: repeat it, or use commas",
                  app::IsExistingPath);
}

std::vector<std::shared_ptr<const Dataset>> LoadArchiveDatasets(const std::vector<std::string>& folders) {
  std::vector<std::shared_ptr<const Dataset>> datasets;
  for (const std::string& folder : folders) datasets.push_back(Dataset::Load(folder, GuardedReader()));
  return datasets;
}

void AddArchiveCommand(const app::Command& program, Invocation* invocation) {
  const auto archive = program.AddCommand(
      "archive", "Pack the results of an experiment into one file; judge such files again; make a website of them");
  archive.RequireCommand();

  const auto pack = archive.AddCommand("pack", "Write the results of an experiment to an archive");
  const auto packed = std::make_shared<ArchivePackOptions>();
  pack.AddOption("ID", packed->experiment, "Experiment (default: the newest)").Check(app::WholeNumber(1));
  pack.AddOption("--about", packed->about, "YAML file with title, authors, paper, licence, code and notes");
  pack.AddOption("--out", packed->out, "Archive, e.g. mine.legopt-archive").Required();
  AddSourceOptions(pack, &packed->source);
  pack.WhenChosen([=] { invocation->body = [packed] { return PackArchive(*packed); }; });

  const auto check = archive.AddCommand("check", "Check that an archive is whole, and describe it");
  const auto checked = std::make_shared<std::filesystem::path>();
  check.AddOption("FILE", *checked, "Archive").Required();
  check.WhenChosen([=] { invocation->body = [checked] { return CheckArchive(*checked); }; });

  const auto judge = archive.AddCommand("judge", "Judge every solution of an archive again, without its programs");
  const auto judged = std::make_shared<ArchiveJudgeOptions>();
  judge.AddOption("FILE", judged->file, "Archive").Required();
  AddArchiveDatasetOption(judge, &judged->datasets);
  judge.AddOption("--out", judged->out, "Write all verdicts and costs to this JSON file");
  AddListingOptions(judge, &judged->listing);
  judge.WhenChosen([=] { invocation->body = [judged] { return JudgeArchiveAgain(*judged); }; });

  const auto unpack =
      archive.AddCommand("unpack",
                         "Judge archives again and write a results database, which 'legopt table', 'report' "
                         "and other commands read");
  const auto unpacked = std::make_shared<ArchiveUnpackOptions>();
  unpack.AddOption("FILE", unpacked->files, "Archives; each becomes an experiment").Required();
  AddArchiveDatasetOption(unpack, &unpacked->datasets);
  unpack.AddOption("--out", unpacked->out, "Database file, e.g. archives.sqlite; it must not exist").Required();
  unpack.WhenChosen([=] { invocation->body = [unpacked] { return UnpackArchives(*unpacked); }; });

  AddSiteCommand(archive, invocation);
}

}  // namespace legopt::client
