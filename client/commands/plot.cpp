#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "app/command_line.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/figures/convergence_figure.h"
#include "client/figures/figures.h"
#include "client/figures/solve_figures.h"
#include "client/plot/drawing.h"
#include "client/plot/plot_points.h"
#include "client/report/reading.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace client {
namespace {

enum class FigureKind { kProfile, kEcdf, kCactus, kBox, kScatter, kRanks, kConvergence };
enum class FigureFormat { kSvg, kPdf, kPgf, kCsv };

}  // namespace
}  // namespace client

template <>
inline constexpr auto kEnumNames<client::FigureKind> =
    MakeEnumNames<client::FigureKind>({{client::FigureKind::kProfile, "profile"},
                                       {client::FigureKind::kEcdf, "ecdf"},
                                       {client::FigureKind::kCactus, "cactus"},
                                       {client::FigureKind::kBox, "box"},
                                       {client::FigureKind::kScatter, "scatter"},
                                       {client::FigureKind::kRanks, "cd"},
                                       {client::FigureKind::kConvergence, "convergence"}});

template <>
inline constexpr auto kEnumNames<client::FigureFormat> =
    MakeEnumNames<client::FigureFormat>({{client::FigureFormat::kSvg, "svg"},
                                         {client::FigureFormat::kPdf, "pdf"},
                                         {client::FigureFormat::kPgf, "pgf"},
                                         {client::FigureFormat::kCsv, "csv"}});

namespace client {
namespace {

constexpr double kPointsPerInch = 72.0;
constexpr char kStandardOutput[] = "-";

struct PlotCommandOptions {
  FigureKind kind = FigureKind::kProfile;
  TableSelection selection;
  std::vector<std::string> columns;
  std::optional<Rule> rule;
  std::optional<Measure> measure;
  std::string out = kStandardOutput;
  std::optional<FigureFormat> format;
  std::string size;
  double font_size_pt = kUsualFontSize_pt;
  bool no_caption = false;
  SourceOptions source;
};

// Returns width and height in points of "3.4x2.5" or "3.4" (inches); nullopt if it is neither.
std::optional<FigureStyle> ParseSize(const std::string& text) {
  constexpr double kSmallest = 1.0, kLargest = 100.0;
  const std::size_t cross = text.find('x');
  std::vector<std::string> parts = {text.substr(0, cross)};
  if (cross != std::string::npos) parts.push_back(text.substr(cross + 1));
  FigureStyle style;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::optional<double> inches = ParseNumber(parts[i]);
    if (!inches || !(*inches >= kSmallest && *inches <= kLargest)) return std::nullopt;
    (i == 0 ? style.width : style.height) = kPointsPerInch * *inches;
  }
  return style;
}

FigureStyle StyleOf(const PlotCommandOptions& options) {
  FigureStyle style = options.size.empty() ? FigureStyle{} : *ParseSize(options.size);
  style.font_size = options.font_size_pt;
  return style;
}

// Returns the chosen format, else that of the file's name, else SVG. Throws ClientError (kUsage) for another ending.
FigureFormat FormatOf(const PlotCommandOptions& options) {
  if (options.format) return *options.format;
  if (options.out == kStandardOutput) return FigureFormat::kSvg;
  const std::string ending = std::filesystem::path(options.out).extension().string();
  const auto format = ParseEnum<FigureFormat>(ending.empty() ? ending : ending.substr(1));
  if (format) return *format;
  throw ClientError(ExitCode::kUsage, "--out " + options.out +
                                          ": unknown file extension; name it .svg, .pdf, .pgf or .csv, "
                                          "or give --format");
}

// Throws ClientError (kUsage) for a measure that the kind of figure does not show.
void CheckMeasure(const PlotCommandOptions& options) {
  if (!options.measure) return;
  const bool by_cost = *options.measure == Measure::kCost;
  if (options.kind == FigureKind::kConvergence && !by_cost) {
    throw ClientError(ExitCode::kUsage, "convergence shows costs over term evaluations; leave --measure away");
  }
  if (options.kind == FigureKind::kProfile) {
    throw ClientError(ExitCode::kUsage,
                      "profiles are by work, or by time where work was not counted; leave --measure away");
  }
}

Plot MakeFigure(const PlotCommandOptions& options, ResultSource& source) {
  CheckMeasure(options);
  TableSelection selection = options.selection;
  selection.rule = RuleFor(source, selection.experiment, options.rule);
  const FigureData data = ReadFigureData(source, selection, options.columns);
  const Measure measure = options.measure.value_or(UsualMeasure(data));
  switch (options.kind) {
    case FigureKind::kProfile: {
      Plot plot = ProfilePlot(data.table);
      KeepRows(options.columns, &plot.panels);
      return plot;
    }
    case FigureKind::kEcdf:
      return EcdfPlot(data, measure);
    case FigureKind::kCactus:
      return CactusPlot(data, measure);
    case FigureKind::kBox:
      return BoxPlot(data, measure);
    case FigureKind::kScatter:
      return ScatterPlot(data, measure);
    case FigureKind::kRanks:
      return RankPlot(data, measure);
    case FigureKind::kConvergence:
      break;
  }
  return ConvergencePlot(source, data);
}

std::string Rendered(const Plot& plot, FigureFormat format, const FigureStyle& style) {
  switch (format) {
    case FigureFormat::kCsv:
      return RenderListing(PointsOf(plot), TableFormat::kCsv);
    case FigureFormat::kPdf:
      return RenderFigure(plot, PlotFormat::kPdf, style);
    case FigureFormat::kPgf:
      return RenderFigure(plot, PlotFormat::kPgf, style);
    case FigureFormat::kSvg:
      break;
  }
  return RenderFigure(plot, PlotFormat::kSvg, style);
}

ExitCode DrawFigure(const PlotCommandOptions& options) {
  const FigureFormat format = FormatOf(options);
  const bool to_output = options.out == kStandardOutput;
  if (to_output && format == FigureFormat::kPdf && StandardOutput().is_terminal) {
    throw ClientError(ExitCode::kUsage, "a PDF file is not for a terminal; give --out FILE.pdf");
  }
  const auto source = OpenResults(options.source);
  Plot plot = MakeFigure(options, *source);
  if (options.no_caption) plot.caption.clear();
  const std::string bytes = Rendered(plot, format, StyleOf(options));
  if (to_output) {
    std::cout << (format == FigureFormat::kCsv ? CsvFor(StandardOutput(), bytes) : bytes) << std::flush;
  } else {
    ReplaceFile(options.out, bytes);
  }
  return ExitCode::kOk;
}

}  // namespace

void AddPlotCommand(const app::Command& program, Invocation* invocation) {
  constexpr double kSmallestFont_pt = 3.0, kLargestFont_pt = 72.0;
  const auto command = program.AddCommand("plot", "Draw a figure for a paper: SVG, PDF, LaTeX or its points");
  const auto options = std::make_shared<PlotCommandOptions>();
  command
      .AddEnum<FigureKind>("KIND", options->kind,
                           "profile (share within a factor of the best), ecdf (share within a value), cactus (sorted "
                           "values), box (quartiles), scatter (two methods), cd (mean ranks and which differ), "
                           "convergence (cost over evaluations)")
      .Required();
  command.AddOption("ID", options->selection.experiment, "Experiment (default: the newest)").Check(app::WholeNumber(1));
  command.AddEnum<Measure>("--measure", options->measure,
                           "What to draw: work (default; time where work was not counted), time, cost or tolerance "
                           "(largest violation of a constraint by a solution)");
  AddResultFilterOptions(command, &options->selection.filter);
  AddRowsOption(command, &options->selection.rows, "methods");
  AddRowsOption(command, &options->columns, "panels", "--columns");
  AddRuleOption(command, &options->rule);
  command.AddOption("--out", options->out, "File, whose ending chooses the format (default: standard output)");
  command.AddEnum<FigureFormat>("--format", options->format,
                                "Format: svg, pdf, pgf (LaTeX's tikz) or csv (the points)");
  const auto bad_size = [](const std::string& text) {
    return ParseSize(text) ? "" : "write WIDTH or WIDTHxHEIGHT in inches from 1 to 100, e.g. 3.4x2.5";
  };
  command.AddOption("--size", options->size, "Width and height in inches, e.g. 3.4x2.5, or the width alone")
      .Check({bad_size, ""});
  command.AddOption("--font-size", options->font_size_pt, "Size of the text in points (default 9)")
      .Check(app::Number(kSmallestFont_pt, kLargestFont_pt));
  command.AddFlag("--no-caption", options->no_caption, "Leave out the text below the figure");
  AddSourceOptions(command, &options->source);
  command.WhenChosen([=] { invocation->body = [options] { return DrawFigure(*options); }; });
}

}  // namespace client
}  // namespace legopt
