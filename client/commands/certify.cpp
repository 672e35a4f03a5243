#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "app/checks.h"
#include "app/command_line.h"
#include "app/isolated_call.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/feasibility_report.h"
#include "client/report/generation_progress.h"
#include "client/report/replaced_file.h"
#include "client/service/interrupt.h"
#include "client/suite/chosen_files.h"
#include "legopt/dataset/dataset.h"
#include "legopt/files/name_lock.h"
#include "legopt/planning/certify/certificate.h"
#include "legopt/planning/certify/dataset_certifier.h"
#include "legopt/planning/certify/stance_catalogue.h"

namespace legopt::client {
namespace {

struct CertifyFlags {
  std::optional<std::string> dataset;
  std::string out;  // empty: the dataset's folder
  certify::CertifyOptions options;
  TableFormat format = TableFormat::kText;
  OutputOptions output;
};

/// Saves the results at intervals, so that little is lost however the process ends.
class CertificateWriter {
 public:
  CertificateWriter(std::filesystem::path path, const certify::StanceCatalogue& catalogue, const Dataset& dataset)
      : path_(std::move(path)), catalogue_(catalogue), dataset_(dataset) {}

  void WriteIfDue(const certify::Certificate& certificate) {
    constexpr auto kPeriod = std::chrono::seconds(10);
    if (std::chrono::steady_clock::now() - written_ < kPeriod) return;
    Write(certificate);
  }
  void Write(const certify::Certificate& certificate) {
    ReplaceFile(path_, certify::FormatCertificate(certificate, catalogue_, dataset_));
    written_ = std::chrono::steady_clock::now();
  }

 private:
  std::filesystem::path path_;
  const certify::StanceCatalogue& catalogue_;
  const Dataset& dataset_;
  std::chrono::steady_clock::time_point written_ = std::chrono::steady_clock::now();
};

ExitCode Certify(const CertifyFlags& flags) {
  const auto dataset = Dataset::Load(ChooseDatasetFolder(flags.dataset, nullptr), CallIsolated);
  const std::filesystem::path out =
      flags.out.empty() ? dataset->folder() / certify::kCertificateFileName : std::filesystem::path(flags.out);
  const files::NameLock lock(out);
  if (!lock.holder().empty()) {
    throw ClientError(ExitCode::kUsage,
                      out.string() + ": " + lock.holder() +
                          " is writing this certificate; wait for that process, or name another --out");
  }
  const certify::StanceCatalogue catalogue(*dataset);
  std::optional<certify::Certificate> known;
  if (std::filesystem::exists(out)) known = certify::ReadCertificate(out, catalogue, *dataset);

  const InterruptGuard guard;
  GenerationProgress progress;
  CertificateWriter writer(out, catalogue, *dataset);
  certify::CertifyHooks hooks;
  hooks.stop = [] { return Interrupted(); };
  hooks.progress = [&](const char* stage, std::size_t done, std::size_t total) {
    progress.Show(stage, static_cast<double>(done), static_cast<double>(total), "stances");
  };
  hooks.on_update = [&](const certify::Certificate& certificate) { writer.WriteIfDue(certificate); };
  const certify::Certificate certificate =
      certify::CertifyDataset(dataset, catalogue, flags.options, known ? &*known : nullptr, hooks);
  progress.Break();
  writer.Write(certificate);
  if (!certificate.IsComplete()) {
    throw ClientError(ExitCode::kInterrupted,
                      "interrupted; the same command continues from the known results in " + out.string());
  }
  const std::string text = RenderFeasibility(certificate, catalogue, *dataset, flags.format, LayoutOf(flags.output));
  Print(flags.format == TableFormat::kCsv ? CsvFor(StandardOutput(), text) : text, flags.output);
  return ExitCode::kOk;
}

}  // namespace

void AddCertifyCommand(const app::Command& program, Invocation* invocation) {
  constexpr int kMaxStarts = 10'000'000;
  constexpr int kMaxThreads = 1024;
  const auto command = program.AddCommand(
      "certify", "Find which problems of a dataset are feasible: a posture or a proof for every stance");
  const auto flags = std::make_shared<CertifyFlags>();
  command.AddOption("DATASET", flags->dataset, "Dataset folder (default: the embedded garage-easier)");
  command.AddOption("--out", flags->out,
                    "Certificate to write or to continue (default: certificate.json in the dataset's folder)");
  command.AddOption("--starts", flags->options.starts, "Initial guesses for a stance before it is reported as open")
      .ShowDefault()
      .Check(app::WholeNumber(1, kMaxStarts));
  flags->options.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  command.AddOption("--threads", flags->options.threads, "Number of threads, same result for any (default: all cores)")
      .Check(app::WholeNumber(1, kMaxThreads));
  AddFormatOption(command, &flags->format);
  AddOutputOptions(command, &flags->output);
  command.WhenChosen([=] { invocation->body = [flags] { return Certify(*flags); }; });
}

}  // namespace legopt::client
