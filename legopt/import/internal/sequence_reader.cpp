#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>

#include "legopt/import/contact_sequence.h"
#include "legopt/import/internal/sequence_comment.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

using Element = tinyxml2::XMLElement;

constexpr std::size_t kLargestArchive_bytes = 256U << 20U;
constexpr int kNewestClassVersion = 2;
constexpr double kRotationTolerance = 1e-6;
constexpr char kSaveAsXml[] = "write it with saveAsXML(FILE, \"ContactSequence\")";

/// Reads one archive. Boost writes the class version of a type only at its first object.
class SequenceReader {
 public:
  SequenceReader(std::string file, std::string_view text) : file_(std::move(file)), text_(text) {}

  ContactSequence Read() {
    RefuseOtherArchives();
    Parse();
    const Element& root = *document_.RootElement();
    const char* signature = root.Attribute("signature");
    if (std::strcmp(root.Name(), "boost_serialization") != 0 || signature == nullptr) {
      Fail(std::string("<") + root.Name() + ">", "", "is no XML archive of boost", kSaveAsXml);
    }
    const Element* of_sequence = root.FirstChildElement();
    if (of_sequence == nullptr) Fail("<boost_serialization>", "", "contains no contact sequence", kSaveAsXml);
    ContactSequence sequence;
    ReadPhases(*of_sequence, &sequence);
    sequence.stances = StancesInComment(document_, file_);
    if (sequence.stances.size() != sequence.phases.size()) sequence.stances.clear();
    return sequence;
  }

 private:
  [[noreturn]] void Fail(std::string field, std::string_view value, std::string message, std::string fix) const {
    throw InputError({.file = file_,
                      .field = std::move(field),
                      .value = std::string(value),
                      .message = std::move(message),
                      .fix = std::move(fix)});
  }

  void RefuseOtherArchives() const {
    constexpr std::size_t kHeader_bytes = 64;
    constexpr std::string_view kSignature = "serialization::archive";
    const std::size_t found = text_.substr(0, kHeader_bytes).find(kSignature);
    if (found == std::string_view::npos || text_.starts_with('<')) return;
    const bool is_text = text_.starts_with("22 ");
    Fail("", "", std::string("is a ") + (is_text ? "text" : "binary") + " archive; only XML archives can be read",
         kSaveAsXml);
  }

  void Parse() {
    if (text_.find_first_not_of(" \t\r\n") == std::string_view::npos) Fail("", "", "the file is empty", kSaveAsXml);
    if (document_.Parse(text_.data(), text_.size()) == tinyxml2::XML_SUCCESS && document_.RootElement() != nullptr) {
      return;
    }
    Fail("line " + std::to_string(document_.ErrorLineNum()), "", "is not well-formed XML", kSaveAsXml);
  }

  static std::string Place(const Element& element, const std::string& outer) {
    return outer + "<" + element.Name() + "> in line " + std::to_string(element.GetLineNum());
  }

  const Element& Child(const Element& parent, const char* name, const std::string& place) const {
    const Element* child = parent.FirstChildElement(name);
    if (child == nullptr) {
      Fail(place, "", std::string("<") + name + "> is missing", "save the sequence again with multicontact-api");
    }
    return *child;
  }

  static std::string_view TextOf(const Element& element) {
    const char* text = element.GetText();
    if (text == nullptr) return {};
    std::string_view trimmed = text;
    const std::size_t begin = trimmed.find_first_not_of(" \t\r\n");
    if (begin == std::string_view::npos) return {};
    return trimmed.substr(begin, trimmed.find_last_not_of(" \t\r\n") - begin + 1);
  }

  double NumberOf(const Element& element, const std::string& place) const {
    const std::optional<double> number = ParseNumber(TextOf(element));
    if (!number || !std::isfinite(*number)) Fail(place, TextOf(element), "must be a finite number", "correct it");
    return *number;
  }

  int CountOf(const Element& element, const std::string& place) const {
    const std::optional<int> number = ParseInteger<int>(TextOf(element));
    if (!number || *number < 0) Fail(place, TextOf(element), "must be a whole number >= 0", "correct it");
    return *number;
  }

  /// Returns the class version of the objects of a type, which only the first one has as an attribute.
  int VersionOf(const Element& element, const std::string& type, const std::string& place) {
    if (const char* given = element.Attribute("version")) {
      const std::optional<int> version = ParseInteger<int>(given);
      if (!version || *version < 0 || *version > kNewestClassVersion) {
        Fail(place + ", version", given, "the class version is unknown",
             "legopt reads versions 0 to " + std::to_string(kNewestClassVersion));
      }
      versions_[type] = *version;
    }
    return versions_[type];
  }

  std::vector<double> ItemsOf(const Element& element, const std::string& place) const {
    std::vector<double> numbers;
    for (const Element* item = element.FirstChildElement("item"); item != nullptr;
         item = item->NextSiblingElement("item")) {
      numbers.push_back(NumberOf(*item, Place(*item, place + ", ")));
    }
    return numbers;
  }

  Eigen::MatrixXd MatrixOf(const Element& element, const std::string& place) const {
    const int rows = CountOf(Child(element, "rows", place), place + ", rows");
    const int cols = CountOf(Child(element, "cols", place), place + ", cols");
    const std::vector<double> items = ItemsOf(Child(element, "data", place), place);
    if (static_cast<double>(items.size()) != static_cast<double>(rows) * cols) {
      Fail(place, std::to_string(items.size()) + " items",
           "must have " + std::to_string(rows) + " x " + std::to_string(cols) + " items", "correct rows and cols");
    }
    return Eigen::Map<const Eigen::MatrixXd>(items.data(), rows, cols);
  }

  void ReadPhases(const Element& element, ContactSequence* sequence) {
    VersionOf(element, "sequence", Place(element, ""));
    const int size = CountOf(Child(element, "size", Place(element, "")), "size");
    if (size == 0) Fail("size", "0", "the sequence has no phases", "save a sequence with at least one contact phase");
    for (const Element* phase = element.FirstChildElement("contact_phase"); phase != nullptr;
         phase = phase->NextSiblingElement("contact_phase")) {
      const std::string place = "phase " + std::to_string(sequence->phases.size()) + ", ";
      sequence->phases.push_back(PhaseOf(*phase, place));
    }
    if (std::ssize(sequence->phases) != size) {
      Fail("size", std::to_string(size),
           "the file has " + std::to_string(sequence->phases.size()) + " elements <contact_phase>",
           "the file is incomplete; save the sequence again");
    }
  }

  SequencePhase PhaseOf(const Element& element, const std::string& place) {
    VersionOf(element, "phase", place + "<contact_phase>");
    SequencePhase phase;
    phase.first = ConfigurationOf(element, "q_init", place);
    phase.last = ConfigurationOf(element, "q_final", place);
    const Element& effectors = Child(element, "effector_in_contact", place + "<contact_phase>");
    const Element& patches = Child(element, "contact_patches", place + "<contact_phase>");
    std::map<std::string, const Element*> by_name;
    for (const Element* item = patches.FirstChildElement("item"); item != nullptr;
         item = item->NextSiblingElement("item")) {
      const std::string where = place + "<contact_patches>";
      by_name[std::string(TextOf(Child(*item, "first", where)))] = &Child(*item, "second", where);
    }
    // In the order of the file, because only the first patch has the class versions.
    std::map<std::string, SequencePatch> read;
    for (const Element* item = patches.FirstChildElement("item"); item != nullptr;
         item = item->NextSiblingElement("item")) {
      const std::string name(TextOf(*item->FirstChildElement("first")));
      read[name] = PatchOf(*by_name[name], name, place + "effector " + name);
    }
    for (const Element* item = effectors.FirstChildElement("item"); item != nullptr;
         item = item->NextSiblingElement("item")) {
      const auto found = read.find(std::string(TextOf(*item)));
      if (found == read.end()) {
        Fail(place + "effector_in_contact", TextOf(*item), "the effector has no placement in <contact_patches>",
             "add its ContactPatch to the phase with addContact");
      }
      phase.patches.push_back(found->second);
    }
    return phase;
  }

  Eigen::VectorXd ConfigurationOf(const Element& phase, const char* name, const std::string& place) const {
    const Element* element = phase.FirstChildElement(name);
    if (element == nullptr) return {};
    const Eigen::MatrixXd matrix = MatrixOf(*element, place + name);
    return matrix.reshaped();
  }

  SequencePatch PatchOf(const Element& element, const std::string& name, const std::string& place) {
    SequencePatch patch;
    patch.effector = name;
    ReadPlacement(Child(element, "placement", place), place + ", placement", &patch);
    if (VersionOf(element, "patch", place) == 0) {
      patch.friction = FrictionOf(Child(element, "mu", place), place + ", mu");
      return patch;
    }
    const Element& model = Child(element, "contact_model", place);
    VersionOf(model, "model", place + ", contact_model");
    patch.friction = FrictionOf(Child(model, "mu", place + ", contact_model"), place + ", mu");
    const Element& type = Child(model, "contact_type", place + ", contact_model");
    const int code = CountOf(type, place + ", contact_type");
    if (code >= static_cast<int>(kNumEnumerators<SequenceContactType>)) {
      Fail(place + ", contact_type", TextOf(type), "is unknown", "write 0 (undefined), 1 (planar) or 2 (point)");
    }
    patch.type = static_cast<SequenceContactType>(code);
    const std::string where = place + ", contact_points_positions";
    const Eigen::MatrixXd points = MatrixOf(Child(model, "contact_points_positions", place), where);
    if (points.rows() != 3) Fail(where + ", rows", std::to_string(points.rows()), "must be 3", "give x, y and z");
    for (Eigen::Index k = 0; k < points.cols(); ++k) patch.points.emplace_back(points.col(k));
    return patch;
  }

  double FrictionOf(const Element& element, const std::string& place) const {
    const double friction = NumberOf(element, place);
    if (friction == SequencePatch::kNoFriction || IsFriction(friction)) return friction;
    Fail(place, TextOf(element), friction < 0.0 ? "friction is negative" : "friction must lie in (0, 2]",
         "set the friction coefficient of the surface, or -1 for that of the dataset's contact");
  }

  void ReadPlacement(const Element& element, const std::string& place, SequencePatch* patch) const {
    const std::vector<double> translation = ItemsOf(Child(element, "translation", place), place + ", translation");
    const std::vector<double> rotation = ItemsOf(Child(element, "rotation", place), place + ", rotation");
    if (translation.size() != 3 || rotation.size() != 9) {
      Fail(place, std::to_string(translation.size()) + " and " + std::to_string(rotation.size()) + " items",
           "must have 3 numbers in <translation> and 9 in <rotation>", "save the sequence again");
    }
    patch->position = Eigen::Map<const Eigen::Vector3d>(translation.data());
    patch->rotation = Eigen::Map<const Eigen::Matrix3d>(rotation.data());  // both column by column
    const Eigen::Matrix3d gram = patch->rotation.transpose() * patch->rotation;
    if ((gram - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kRotationTolerance ||
        patch->rotation.determinant() < 0.0) {
      Fail(place + ", rotation", "", "is no rotation: its columns are not orthonormal and right-handed",
           "normalise the placement before saving");
    }
  }

  std::string file_;
  std::string_view text_;
  tinyxml2::XMLDocument document_;
  std::map<std::string, int> versions_;
};

}  // namespace

ContactSequence ReadContactSequence(const std::filesystem::path& file) {
  const std::string text = ReadFileText(file, kLargestArchive_bytes);
  return SequenceReader(file.string(), text).Read();
}

}  // namespace legopt
