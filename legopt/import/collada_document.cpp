#include "legopt/import/collada_document.h"

#include <unzip.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <memory>

#include "legopt/import/degree.h"
#include "legopt/input/file_text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"
#include "legopt/types/numeric_locale.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;

constexpr const char* kSpace = " \t\r\n";

std::string LowerSuffix(const fs::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(), [](unsigned char c) { return std::tolower(c); });
  return suffix;
}

[[noreturn]] void Refuse(const fs::path& path, const std::string& field, const std::string& value,
                         const std::string& message, const std::string& fix) {
  throw InputError({path.string(), field, value, message, fix});
}

std::string ReadFile(const fs::path& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 30;
  return ReadFileText(path, kMostBytes);
}

struct CloseArchive {
  void operator()(void* archive) const { unzClose(archive); }
};
using Archive = std::unique_ptr<void, CloseArchive>;

/// Reads all bytes of the archive's current file. Does not trust the size in the header, so that memory grows only with
/// the actual content.
std::string Unpack(const fs::path& path, void* archive, const std::string& name) {
  constexpr size_t kMaxBytes = size_t{1} << 30;
  constexpr size_t kBlock_bytes = size_t{1} << 16;
  std::string text;
  int count = unzOpenCurrentFile(archive) == UNZ_OK ? 1 : -1;
  while (count > 0 && text.size() < kMaxBytes) {
    const size_t before = text.size();
    text.resize(before + kBlock_bytes);
    count = unzReadCurrentFile(archive, text.data() + before, static_cast<unsigned>(kBlock_bytes));
    text.resize(before + static_cast<size_t>(std::max(count, 0)));
  }
  if (unzCloseCurrentFile(archive) != UNZ_OK || count != 0) {  // closing compares the checksum
    Refuse(path, name, std::to_string(text.size()) + " bytes", "cannot be unpacked", "pack the archive again");
  }
  return text;
}

/// Returns the only COLLADA document of a zip archive.
std::string ReadArchive(const fs::path& path) {
  ReadFile(path);  // reports a missing file, before unzOpen reports a wrong format
  const Archive archive(unzOpen(path.c_str()));
  if (archive == nullptr) Refuse(path, "", "", "is not a zip archive", "give the .dae file itself");
  std::string text;
  int documents = 0;
  for (int state = unzGoToFirstFile(archive.get()); state == UNZ_OK; state = unzGoToNextFile(archive.get())) {
    std::array<char, 1024> name{};
    unz_file_info info{};  // minizip writes into it unconditionally
    unzGetCurrentFileInfo(archive.get(), &info, name.data(), name.size() - 1, nullptr, 0, nullptr, 0);
    if (LowerSuffix(name.data()) != ".dae") continue;
    if (++documents == 1) text = Unpack(path, archive.get(), name.data());
  }
  if (documents == 1) return text;
  Refuse(path, "*.dae", std::to_string(documents), "a robot's archive holds one COLLADA document",
         "unpack it and name the robot's .dae file");
}

void CollectAll(const XMLElement& root, std::string_view name, std::vector<const XMLElement*>* found) {
  for (const XMLElement* e = root.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    if (e->Name() == name) {
      found->push_back(e);
    } else {
      CollectAll(*e, name, found);
    }
  }
}

/// Returns the child <name> of the parent, or the <wrapper> inside it.
const XMLElement* Wrapped(const XMLElement& parent, const char* name, const char* wrapper) {
  const XMLElement* element = parent.FirstChildElement(name);
  if (element == nullptr) return nullptr;
  const XMLElement* inner = element->FirstChildElement(wrapper);
  return inner != nullptr ? inner : element;
}

}  // namespace

ColladaDocument::ColladaDocument(const fs::path& path) : path_(path) {
  const std::string text = LowerSuffix(path) == ".zae" ? ReadArchive(path) : ReadFile(path);
  if (document_.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) {
    Refuse(path_, "line " + std::to_string(document_.ErrorLineNum()), "",
           std::string("not valid XML: ") + document_.ErrorName(), "correct the file");
  }
  if (document_.RootElement() == nullptr || document_.RootElement()->Name() != std::string_view("COLLADA")) {
    Refuse(path_, "<COLLADA>", "", "is not a COLLADA file", "give a .dae or .zae file with kinematics");
  }
  const XMLElement* asset = root().FirstChildElement("asset");
  if (asset == nullptr) return;
  const XMLElement* up = asset->FirstChildElement("up_axis");
  // The format's default is Y_UP, but robots without this element were written by hand with z up.
  if (up != nullptr && up->GetText() != nullptr && std::string_view(up->GetText()).find("Z_UP") == std::string::npos) {
    Fail(*up, up->GetText(), "another axis than z points up", "export the robot again with z up");
  }
  const XMLElement* unit = asset->FirstChildElement("unit");
  if (unit == nullptr) return;
  const char* meter = unit->Attribute("meter");
  if (meter == nullptr) return;
  unit_m_ = ParseNumber(meter).value_or(0.0);
  if (!(unit_m_ > 0.0) || !std::isfinite(unit_m_)) {
    Fail(*unit, meter, "the unit of length must be a positive number", "write meter=\"1\"");
  }
}

std::vector<const XMLElement*> ColladaDocument::FindAll(const XMLElement& root, const char* name) {
  std::vector<const XMLElement*> found;
  CollectAll(root, name, &found);
  return found;
}

const XMLElement* ColladaDocument::FindFirst(const XMLElement& root, const char* name) {
  const auto found = FindAll(root, name);
  return found.empty() ? nullptr : found.front();
}

void ColladaDocument::Fail(const XMLElement& element, const std::string& value, const std::string& message,
                           const std::string& fix) const {
  Refuse(path_, "line " + std::to_string(element.GetLineNum()) + ", <" + element.Name() + ">", value, message, fix);
}

std::string ColladaDocument::Attribute(const XMLElement& element, const char* name) const {
  const char* value = element.Attribute(name);
  if (value == nullptr || *value == '\0') {
    Fail(element, "", "the attribute '" + std::string(name) + "' is missing", "add it, or export the file again");
  }
  return value;
}

std::vector<double> ColladaDocument::Numbers(const XMLElement& element, int count) const {
  std::vector<double> numbers;
  const std::string_view text = element.GetText() != nullptr ? element.GetText() : "";
  for (size_t begin = text.find_first_not_of(kSpace); begin != std::string_view::npos;) {
    const size_t end = std::min(text.find_first_of(kSpace, begin), text.size());
    const std::string_view token = text.substr(begin, end - begin);
    double value = 0.0;
    const auto [stop, error] = std::from_chars(token.data(), token.data() + token.size(), value);
    if (error != std::errc() || stop != token.data() + token.size() || !std::isfinite(value)) {
      Fail(element, std::string(token), "is not a finite number", "correct it");
    }
    numbers.push_back(value);
    begin = text.find_first_not_of(kSpace, end);
  }
  if (count >= 0 && std::ssize(numbers) != count) {
    Fail(element, std::to_string(numbers.size()) + " numbers", "needs " + std::to_string(count) + " numbers",
         "correct it");
  }
  return numbers;
}

double ColladaDocument::Number(const XMLElement& parent, const char* name, double fallback) const {
  const XMLElement* element = Wrapped(parent, name, "float");
  return element == nullptr ? fallback : Numbers(*element, 1).front();
}

bool ColladaDocument::Flag(const XMLElement& parent, const char* name, bool fallback) const {
  const XMLElement* element = Wrapped(parent, name, "bool");
  if (element == nullptr) return fallback;
  bool value = false;
  if (element->QueryBoolText(&value) != tinyxml2::XML_SUCCESS) {
    Fail(*element, element->GetText() != nullptr ? element->GetText() : "", "is neither true nor false", "correct it");
  }
  return value;
}

Eigen::Isometry3d ColladaDocument::Transform(const XMLElement& element) const {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  for (const XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    const std::string_view name = e->Name();
    if (name == "translate") {
      const std::vector<double> t = Numbers(*e, 3);
      transform.translate(unit_m_ * Eigen::Vector3d(t[0], t[1], t[2]));
    } else if (name == "rotate") {
      const std::vector<double> r = Numbers(*e, 4);
      const Eigen::Vector3d axis(r[0], r[1], r[2]);
      if (r[3] == 0.0) continue;  // also for a fixed joint, whose axis is zero
      if (!(axis.norm() > 0.0)) Fail(*e, "", "the axis of rotation has no length", "correct it");
      transform.rotate(Eigen::AngleAxisd(kDegree * r[3], axis.normalized()));
    } else if (name == "matrix") {
      const std::vector<double> m = Numbers(*e, 16);
      Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
      step.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(m.data());
      constexpr double kRounding = 1e-4;
      const bool rotation =
          (step.linear() * step.linear().transpose()).isIdentity(kRounding) && step.linear().determinant() > 0.0;
      if (!rotation) {
        Fail(*e, "", "is not a rotation and a translation", "apply the scale to the meshes and export again");
      }
      transform.translate(unit_m_ * step.translation());
      transform.rotate(Eigen::Quaterniond(step.linear()).normalized());
    } else if (name == "scale" || name == "skew" || name == "lookat") {
      Fail(*e, "", "only translate, rotate and matrix can be read here", "apply it to the meshes and export again");
    }
  }
  return transform;
}

bool IsColladaRobot(const fs::path& path) {
  const std::string suffix = LowerSuffix(path);
  if (suffix == ".zae") return true;
  return suffix == ".dae" && ReadFile(path).find("<kinematics_model") != std::string::npos;
}

std::string_view LastPart(std::string_view reference) {
  const size_t separator = reference.find_last_of("#/");
  return separator == std::string_view::npos ? reference : reference.substr(separator + 1);
}

}  // namespace legopt
