#include "legopt/import/internal/srdf.h"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>
#include <utility>

#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLargestFile = 10U << 20U;
constexpr std::array<std::string_view, 8> kStandingNames = {"half_sitting", "standing",  "stand",   "stance",
                                                            "home",         "reference", "default", "initial"};

/// Lower case, with '_' for blanks and '-'.
std::string Plain(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) {
    return c == ' ' || c == '-' ? '_' : static_cast<char>(std::tolower(c));
  });
  return text;
}

std::vector<fs::path> SrdfFiles(const fs::path& urdf) {
  std::vector<fs::path> files;
  const fs::path folder = urdf.parent_path();
  for (const fs::path& place : {folder, folder / "srdf", folder.parent_path() / "srdf"}) {
    std::error_code error;
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(place, error)) {
      if (Plain(entry.path().extension().string()) == ".srdf" && entry.is_regular_file(error) &&
          entry.file_size(error) <= kLargestFile) {
        found.push_back(entry.path());
      }
    }
    std::sort(found.begin(), found.end());
    files.insert(files.end(), found.begin(), found.end());
  }
  // One that is named like the URDF comes first.
  std::stable_partition(files.begin(), files.end(), [&](const fs::path& file) { return file.stem() == urdf.stem(); });
  return files;
}

std::map<std::string, double> JointsOf(const tinyxml2::XMLElement& state, const RobotModel& robot) {
  std::map<std::string, double> joints;
  for (const auto* joint = state.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const char* name = joint->Attribute("name");
    const char* value = joint->Attribute("value");
    if (name == nullptr || value == nullptr) continue;
    const std::optional<double> number = ParseNumber(value);
    const int index = robot.FindJoint(name);
    if (!number || !std::isfinite(*number) || index < 0) continue;
    const Joint& found = robot.joints()[static_cast<std::size_t>(index)];
    if (found.dof >= 0) joints[name] = *number;
  }
  return joints;
}

/// Rank of a state's name; kStandingNames.size() if it begins with none of them.
std::size_t RankOf(const std::string& name) {
  const std::string plain = Plain(name);
  const auto found =
      std::ranges::find_if(kStandingNames, [&](std::string_view known) { return plain.starts_with(known); });
  return static_cast<std::size_t>(found - kStandingNames.begin());
}

std::string TextOf(const tinyxml2::XMLElement& element, const char* attribute) {
  const char* text = element.Attribute(attribute);
  return text == nullptr ? "" : text;
}

void AddDisabledPairs(const tinyxml2::XMLElement& root, const RobotModel& robot, SrdfContent* content) {
  constexpr const char* kName = "disable_collisions";
  for (const auto* e = root.FirstChildElement(kName); e != nullptr; e = e->NextSiblingElement(kName)) {
    SrdfPair pair{TextOf(*e, "link1"), TextOf(*e, "link2"), Plain(TextOf(*e, "reason"))};
    const int first = robot.FindLink(pair.first), second = robot.FindLink(pair.second);
    if (first < 0 || second < 0 || first == second) continue;
    if (first > second) std::swap(pair.first, pair.second);
    content->disabled.push_back(std::move(pair));
  }
}

void AddLegTips(const tinyxml2::XMLElement& root, const RobotModel& robot, SrdfContent* content) {
  for (const auto* group = root.FirstChildElement("group"); group != nullptr;
       group = group->NextSiblingElement("group")) {
    const std::string name = Plain(TextOf(*group, "name"));
    const bool is_leg = name.find("leg") != std::string::npos || name.find("foot") != std::string::npos;
    const tinyxml2::XMLElement* chain = is_leg ? group->FirstChildElement("chain") : nullptr;
    if (chain == nullptr) continue;
    const std::string tip = TextOf(*chain, "tip_link");
    const bool known = std::ranges::find(content->leg_tips, tip) != content->leg_tips.end();
    if (robot.FindLink(tip) >= 0 && !known) content->leg_tips.push_back(tip);
  }
}

}  // namespace

SrdfContent ReadSrdf(const fs::path& urdf, const RobotModel& robot) {
  SrdfContent content;
  for (const fs::path& file : SrdfFiles(urdf)) {
    tinyxml2::XMLDocument document;
    if (document.LoadFile(file.string().c_str()) != tinyxml2::XML_SUCCESS || document.RootElement() == nullptr) {
      content.faults.push_back(file.filename().string() + ": not valid XML");
      continue;
    }
    if (!content.file.empty()) continue;
    AddDisabledPairs(*document.RootElement(), robot, &content);
    AddLegTips(*document.RootElement(), robot, &content);
    if (!content.disabled.empty() || !content.leg_tips.empty()) content.file = file;
  }
  return content;
}

std::optional<SrdfState> FindStandingState(const fs::path& urdf, const RobotModel& robot) {
  for (const fs::path& file : SrdfFiles(urdf)) {
    tinyxml2::XMLDocument document;
    if (document.LoadFile(file.string().c_str()) != tinyxml2::XML_SUCCESS || document.RootElement() == nullptr) {
      continue;
    }
    SrdfState best;
    std::size_t best_rank = kStandingNames.size();
    for (const auto* state = document.RootElement()->FirstChildElement("group_state"); state != nullptr;
         state = state->NextSiblingElement("group_state")) {
      const char* name = state->Attribute("name");
      if (name == nullptr || RankOf(name) >= best_rank) continue;
      std::map<std::string, double> joints = JointsOf(*state, robot);
      if (2 * joints.size() < static_cast<std::size_t>(robot.num_dofs())) continue;
      best = {.file = file, .name = name, .joints = std::move(joints)};
      best_rank = RankOf(name);
    }
    if (best_rank < kStandingNames.size()) return best;
  }
  return {};
}

}  // namespace legopt
