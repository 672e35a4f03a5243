#include <algorithm>
#include <array>
#include <cstddef>
#include <set>
#include <string_view>

#include "legopt/import/contact_sequence.h"
#include "legopt/import/internal/sequence_comment.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

constexpr std::string_view kHeader =
    "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\" ?>\n"
    "<!DOCTYPE boost_serialization>\n"
    "<boost_serialization signature=\"serialization::archive\" version=\"17\">\n";

// Class versions that multicontact-api 3 writes, of its own classes and of the others.
constexpr int kApiVersion = 2, kSharedPointerVersion = 1, kPlainVersion = 0;

/// Writes elements in the order and form of Boost's XML archives. The first object of each type has its class version.
class SequenceWriter {
 public:
  std::string Write(const ContactSequence& sequence) {
    text_ = kHeader;
    Open("ContactSequence", kApiVersion);
    Line("size", std::to_string(sequence.phases.size()));
    for (const SequencePhase& phase : sequence.phases) WritePhase(phase);
    Close("ContactSequence");
    text_ += "</boost_serialization>\n";
    if (!sequence.stances.empty()) text_ += CommentOf(sequence.stances);
    return std::move(text_);
  }

 private:
  static std::string Escaped(std::string_view text) {
    std::string escaped;
    for (const char c : text) {
      switch (c) {
        case '&':
          escaped += "&amp;";
          break;
        case '<':
          escaped += "&lt;";
          break;
        case '>':
          escaped += "&gt;";
          break;
        case '"':
          escaped += "&quot;";
          break;
        case '\'':
          escaped += "&apos;";
          break;
        default:
          escaped += c;
      }
    }
    return escaped;
  }

  static std::string Number(double value) {
    constexpr int kDecimals = 17;
    return FormatScientific(value, kDecimals);
  }

  void Indent() { text_.append(static_cast<std::size_t>(depth_), '\t'); }

  /// Opens an element whose type has no class version.
  void Open(std::string_view name) {
    Indent();
    text_ += "<" + std::string(name) + ">\n";
    ++depth_;
  }

  /// Opens an object of a type, which is named by its first element unless `type` is given.
  void Open(std::string_view name, int version, std::string_view type = {}) {
    Indent();
    text_ += "<" + std::string(name);
    if (types_.insert(std::string(type.empty() ? name : type)).second) {
      text_ += " class_id=\"" + std::to_string(types_.size() - 1) + "\" tracking_level=\"0\" version=\"" +
               std::to_string(version) + "\"";
    }
    text_ += ">\n";
    ++depth_;
  }

  void Close(std::string_view name) {
    --depth_;
    Indent();
    text_ += "</" + std::string(name) + ">\n";
  }

  void Line(std::string_view name, const std::string& value) {
    Indent();
    text_ += "<" + std::string(name) + ">" + value + "</" + std::string(name) + ">\n";
  }

  template <class Numbers>
  void WriteItems(std::string_view name, const Numbers& numbers) {
    if (numbers.size() == 0) {
      Line(name, "");
      return;
    }
    Open(name);
    for (Eigen::Index i = 0; i < numbers.size(); ++i) Line("item", Number(numbers.data()[i]));
    Close(name);
  }

  template <class Matrix>
  void WriteMatrix(std::string_view name, const Matrix& matrix, std::string_view type) {
    Open(name, kPlainVersion, type);
    Line("rows", std::to_string(matrix.rows()));
    Line("cols", std::to_string(matrix.cols()));
    WriteItems("data", matrix);
    Close(name);
  }

  void WriteNoCurve(std::string_view name, std::string_view type) {
    Open(name, kSharedPointerVersion, type);
    Indent();
    text_ += "<px class_id=\"-1\"></px>\n";
    Close(name);
  }

  void WriteNoCurves(std::string_view name, const std::string& type) {
    Open(name, kPlainVersion, type);
    Open("Parent", kPlainVersion, type + " map");
    WriteCount(0);
    Close("Parent");
    Close(name);
  }

  void WriteCount(std::size_t count) {
    Line("count", std::to_string(count));
    Line("item_version", "0");
  }

  /// Writes the states of the centroidal motion at one end of a phase, which are zero, and the configuration.
  void WriteEnd(const std::string& end, const Eigen::VectorXd& configuration) {
    for (const std::string_view of : {"c", "dc", "ddc", "L", "dL"}) {
      WriteMatrix(std::string(of) + end, Eigen::Vector3d::Zero().eval(), "vector of three");
    }
    WriteMatrix("q" + end, Eigen::MatrixXd(configuration), "vector");
  }

  void WritePhase(const SequencePhase& phase) {
    Open("contact_phase", kApiVersion);
    WriteEnd("_init", phase.first);
    WriteEnd("_final", phase.last);
    for (const std::string_view name : {"q", "dq", "ddq", "tau", "c", "dc", "ddc", "L", "dL", "wrench", "zmp"}) {
      WriteNoCurve(name, "curve");
    }
    WriteNoCurve("root", "curve of placements");
    WriteNoCurves("contact_forces", "curves");
    WriteNoCurves("contact_normal_force", "curves");
    WriteNoCurves("effector_trajectories", "curves of placements");
    Open("effector_in_contact", kPlainVersion);
    WriteCount(phase.patches.size());
    for (const SequencePatch& patch : phase.patches) Line("item", Escaped(patch.effector));
    Close("effector_in_contact");
    WritePatches(phase.patches);
    Line("t_init", Number(-1.0));  // no times
    Line("t_final", Number(-1.0));
    Close("contact_phase");
  }

  /// Writes the map from effectors to patches, which is sorted by name.
  void WritePatches(const std::vector<SequencePatch>& patches) {
    std::vector<const SequencePatch*> sorted;
    for (const SequencePatch& patch : patches) sorted.push_back(&patch);
    std::ranges::sort(sorted, {}, [](const SequencePatch* patch) { return patch->effector; });
    Open("contact_patches", kPlainVersion);
    WriteCount(sorted.size());
    for (const SequencePatch* patch : sorted) {
      Open("item", kPlainVersion, "effector and patch");
      Line("first", Escaped(patch->effector));
      WritePatch(*patch);
      Close("item");
    }
    Close("contact_patches");
  }

  void WritePatch(const SequencePatch& patch) {
    Open("second", kApiVersion);
    Open("placement", kPlainVersion);
    WriteItems("translation", patch.position);
    WriteItems("rotation", patch.rotation);
    Close("placement");
    Open("contact_model", kApiVersion);
    Line("mu", Number(patch.friction));
    Line("contact_type", std::to_string(static_cast<int>(patch.type)));
    Line("num_contact_points", std::to_string(patch.points.size()));
    Eigen::Matrix3Xd points(3, std::ssize(patch.points));
    for (std::size_t k = 0; k < patch.points.size(); ++k) points.col(static_cast<Eigen::Index>(k)) = patch.points[k];
    WriteMatrix("contact_points_positions", points, "points");
    Close("contact_model");
    Close("second");
  }

  std::string text_;
  int depth_ = 0;
  std::set<std::string> types_;
};

}  // namespace

std::string FormatContactSequence(const ContactSequence& sequence) { return SequenceWriter().Write(sequence); }

}  // namespace legopt
