#include <iostream>
#include <memory>
#include <optional>

#include "app/command_line.h"
#include "app/folder_cache.h"
#include "app/printable.h"
#include "client/archive/archive_file.h"
#include "client/archive/archive_judge.h"
#include "client/archive/archive_pack.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/escaped_text.h"
#include "client/report/result_dataset.h"
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
  std::optional<std::string> dataset;
  std::optional<std::filesystem::path> out;
  ListingOptions listing;
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

std::shared_ptr<const Dataset> DatasetFor(const Archive& archive, const ArchiveJudgeOptions& options) {
  const auto dataset =
      options.dataset ? Dataset::Load(*options.dataset, GuardedReader()) : FindLocalDataset(archive.dataset_hash);
  if (dataset == nullptr) {
    throw ClientError(ExitCode::kDatasetMismatch, "the archive's dataset " + archive.dataset + " (" +
                                                      archive.dataset_hash.substr(0, 12) +
                                                      ") is not on this machine; give --dataset FOLDER");
  }
  if (dataset->content_hash() != archive.dataset_hash) {
    throw ClientError(ExitCode::kDatasetMismatch,
                      dataset->folder().string() + " has content " + dataset->content_hash().substr(0, 12) +
                          ", the archive's dataset " + archive.dataset + " has " + archive.dataset_hash.substr(0, 12));
  }
  return dataset;
}

ExitCode JudgeArchiveAgain(const ArchiveJudgeOptions& options) {
  const Archive archive = ReadArchive(options.file);
  std::cerr << "legopt: judging " << archive.results.size() << " results\n";
  const JudgedArchive judged = JudgeArchive(archive, DatasetFor(archive, options));
  if (options.out) ReplaceFile(*options.out, JsonText(JudgementJson(archive, judged)) + "\n");
  PrintTable(JudgementTable(archive, judged), options.listing);
  if (judged.differing == 0) return ExitCode::kOk;
  throw ClientError(ExitCode::kOtherResult, options.file.string() + ": " + std::to_string(judged.differing) + " of " +
                                                std::to_string(archive.results.size()) +
                                                " results have another verdict or cost than the archive states");
}

}  // namespace

void AddArchiveCommand(const app::Command& program, Invocation* invocation) {
  const auto archive =
      program.AddCommand("archive", "Pack the results of an experiment into one file; check and re-judge such files");
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
  judge.AddOption("--dataset", judged->dataset,
                  "Dataset folder (default: the dataset with the archive's hash: embedded, submitted or fetched)");
  judge.AddOption("--out", judged->out, "Write all verdicts and costs to this JSON file");
  AddListingOptions(judge, &judged->listing);
  judge.WhenChosen([=] { invocation->body = [judged] { return JudgeArchiveAgain(*judged); }; });
}

}  // namespace legopt::client
