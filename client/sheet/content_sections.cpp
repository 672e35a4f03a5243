#include "client/sheet/content_sections.h"

#include <algorithm>
#include <filesystem>
#include <functional>

#include "client/report/escaped_text.h"
#include "client/sheet/feature_file.h"
#include "client/sheet/sheet_text.h"
#include "legopt/types/number_text.h"
#include "legopt/worldgen/internal/histogram.h"

namespace legopt::client {
namespace {

using Visit = std::function<void(const Stance&)>;

void ForEachStance(const Dataset& dataset, Task task, const Visit& visit) {
  for (const ProblemDefinition& problem : dataset.problems(task)) {
    for (const Stance& stance : problem.stances) visit(stance);
  }
}

std::vector<std::string> TaskRow(const Dataset& dataset, Task task) {
  int stances = 0, by_forces = 0;
  std::vector<double> lengths, contacts, pushes_N;
  for (const ProblemDefinition& problem : dataset.problems(task)) {
    lengths.push_back(static_cast<double>(problem.stances.size()));
  }
  ForEachStance(dataset, task, [&](const Stance& stance) {
    ++stances;
    by_forces += StandsOnFeet(dataset, stance) ? 0 : 1;
    contacts.push_back(static_cast<double>(stance.contacts.size()));
    if (stance.push_N) pushes_N.push_back(*stance.push_N);
  });
  return {std::string(ToString(task)),
          std::to_string(lengths.size()),
          std::to_string(stances),
          SheetRange(lengths),
          SheetRange(contacts),
          std::to_string(by_forces),
          std::to_string(pushes_N.size()),
          SheetRange(pushes_N)};
}

/// Counts of the rows of features.csv by family and level; empty without these columns.
std::string FamilyTable(const Dataset& dataset) {
  const std::filesystem::path path = dataset.folder() / "features.csv";
  if (!std::filesystem::exists(path)) return {};
  const FeatureFile features = ReadFeatures(path);
  if (!features.Find("family") || !features.Find("level")) return {};
  const std::vector<std::string> levels = features.Words("level");
  SheetTable table{{"family"}, {}};
  table.columns.insert(table.columns.end(), levels.begin(), levels.end());
  table.columns.emplace_back("all");
  for (const std::string& family : features.Words("family")) {
    std::vector<std::string>& row = table.rows.emplace_back(std::vector<std::string>{family});
    for (const std::string& level : levels) {
      row.push_back(std::to_string(features.Count({{"family", family}, {"level", level}})));
    }
    row.push_back(std::to_string(features.Count({{"family", family}})));
  }
  return "Posture problems by family and level (`features.csv`):\n\n" + FormatSheetTable(table);
}

/// Row of a contact: declared values, and how stances use it.
std::vector<std::string> ContactRow(const Dataset& dataset, const Contact& contact) {
  const bool cones = contact.facts().forces == ContactForces::kFrictionCones;
  int used = 0, touching = 0;
  std::vector<double> frictions;
  for (const TaskDescription& task : ProblemTasks()) {
    ForEachStance(dataset, task.task, [&](const Stance& stance) {
      for (const ContactTarget& target : stance.contacts) {
        if (target.contact != contact.name) continue;
        ++used;
        touching += target.carries ? 0 : 1;
        if (cones) frictions.push_back(target.friction.value_or(contact.friction));
      }
    });
  }
  const auto optional = [](bool given, double value) { return given ? SheetNumber(value) : std::string("-"); };
  return {contact.name,
          contact.link,
          std::string(ToString(contact.kind)),
          std::to_string(contact.points_L.size()),
          optional(cones, contact.friction),
          SheetRange(frictions),
          cones ? optional(contact.max_normal_N.has_value(), contact.max_normal_N.value_or(0.0))
                : SheetNumber(contact.max_force_N) + " each way",
          optional(contact.facts().slides, contact.slide_m),
          std::to_string(used),
          std::to_string(touching)};
}

std::string SizeText(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d size = box.sizes();
  return SheetNumber(size.x()) + " x " + SheetNumber(size.y()) + " x " + SheetNumber(size.z()) + " m";
}

bool IsFeature(const std::string& column) { return column != "id" && column != "stance"; }

}  // namespace

std::string ProblemSection(const Dataset& dataset) {
  SheetTable table{{"task", "problems", "stances", "stances per problem", "contacts per stance",
                    "stances judged by forces", "stances with a push", "push, N"},
                   {}};
  for (const TaskDescription& task : ProblemTasks()) {
    if (!dataset.problems(task.task).empty()) table.rows.push_back(TaskRow(dataset, task.task));
  }
  const std::string note =
      "Stances judged by forces: palms or rails carry, so that every rule requires static equilibrium with "
      "friction.\n\n";
  return SheetSection("Problems", FormatSheetTable(table) + note + FamilyTable(dataset));
}

std::string ContactSection(const Dataset& dataset) {
  SheetTable table{{"contact", "link", "kind", "points", "friction", "friction in stances", "largest force, N",
                    "slide, m", "stances", "without force"},
                   {}};
  for (const Contact& contact : dataset.contacts()) table.rows.push_back(ContactRow(dataset, contact));
  return SheetSection("Contacts", FormatSheetTable(table) +
                                      "Largest force: of soles, points and palms, the sum of the normal forces; of "
                                      "rails, each component at each point.\n\n");
}

std::string RobotSection(const Dataset& dataset) {
  const RobotModel& robot = dataset.robot();
  SheetTable table{{"joint", "type", "lower", "upper", "unit", "effort", "velocity"}, {}};
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    const Joint& joint = robot.joints()[static_cast<std::size_t>(robot.dof_joint(dof))];
    table.rows.push_back({joint.name, std::string(ToString(joint.type)), SheetNumber(joint.lower),
                          SheetNumber(joint.upper), std::string(UnitOf(joint.type)),
                          SheetNumber(robot.effort_limits()[dof]), SheetNumber(robot.velocity_limits()[dof])});
  }
  const std::string facts =
      "`" + MarkdownText(app::Printable(robot.name())) + "`: " + std::to_string(robot.links().size()) + " links, " +
      std::to_string(robot.num_dofs()) + " degrees of freedom besides the base, " + SheetNumber(robot.total_mass()) +
      " kg. In the nominal posture, its box is " + SizeText(dataset.robot_bounds()) + ", and the trunk is " +
      SheetNumber(dataset.trunk_height_m()) + " m above the feet.\n\n";
  return SheetSection("Robot", facts + FormatSheetTable(table) +
                                   "Efforts in N m (prismatic: N), velocities in rad/s (m/s); `-`: no limit. Efforts "
                                   "count by the physical rule only, velocities by none.\n\n");
}

std::string FeatureSection(const Dataset& dataset) {
  const std::filesystem::path path = dataset.folder() / "features.csv";
  if (!std::filesystem::exists(path)) return {};
  const FeatureFile features = ReadFeatures(path);
  std::string text;
  std::vector<std::string> tasks = features.Words("task");
  if (tasks.empty()) tasks.emplace_back("");
  for (const std::string& task : tasks) {
    for (std::size_t column = 0; column < features.columns.size(); ++column) {
      const std::string& name = features.columns[column];
      const std::vector<double> values = features.Numbers(column, "task", task);
      if (values.empty() || !IsFeature(name)) continue;
      text += worldgen::FormatHistogram(worldgen::MakeHistogram((task.empty() ? "" : task + ": ") + name, "", values)) +
              "\n";
    }
  }
  if (text.empty()) return {};
  while (text.ends_with("\n")) text.pop_back();
  std::string indented;
  ClassicInput lines(app::PrintableLines(text));
  for (std::string line; std::getline(lines, line);) {
    line.erase(line.find_last_not_of(' ') + 1);
    indented += line.empty() ? "\n" : "    " + line + "\n";
  }
  return SheetSection(
      "Features",
      "Numbers of rows of `features.csv` by the values of its columns; names end in the unit.\n\n" + indented + "\n");
}

}  // namespace legopt::client
