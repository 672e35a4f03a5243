#include "legopt/dataset/contact.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <set>
#include <string>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/internal/dataset_writer.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using test::MessageOf;
using test::ReplaceInFile;
using test::WriteText;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kFormat1 = "feet: [l_foot, r_foot]\nsole_offset_m: 0.051\n";

/// Returns the synthetic dataset's contacts in format 2, with more keys for the left one.
std::string Contacts(const std::string& left = "") {
  const std::string frame = "    frame: {position: [0, 0, -0.051]}\n";
  return "contacts:\n  l_foot:\n    link: l_foot\n    kind: sole\n" + frame + left +
         "  r_foot:\n    link: r_foot\n    kind: sole\n" + frame;
}

class ContactTest : public testing::Test {
 protected:
  ContactTest() { const test::SyntheticFolder files(folder_.path()); }

  std::shared_ptr<const Dataset> Load() const { return Dataset::Load(folder_.path()); }
  /// Writes the contacts in format 2.
  void Use(const std::string& contacts) {
    const test::SyntheticFolder files(folder_.path());
    ReplaceInFile(folder_.path() / "dataset.yaml", "legopt-dataset/1", "legopt-dataset/2");
    ReplaceInFile(folder_.path() / "dataset.yaml", kFormat1, contacts);
  }
  std::string MessageWith(const std::string& contacts) {
    Use(contacts);
    return MessageOf([&] { Load(); });
  }

  test::TemporaryFolder folder_;
};

TEST_F(ContactTest, FormatsThatMeanTheSameAreTheSame) {
  const auto first = Load();
  Use(Contacts());
  const auto second = Load();
  EXPECT_EQ(first->content_hash(), second->content_hash());
  ASSERT_EQ(second->contacts().size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    const Contact& a = first->contacts()[i];
    const Contact& b = second->contacts()[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.points_L, b.points_L);
    EXPECT_EQ(a.X_LC.matrix(), b.X_LC.matrix());
    EXPECT_EQ(a.friction, b.friction);
  }
}

TEST_F(ContactTest, EveryValueOfFormat2ChangesTheHash) {
  const std::string base = Load()->content_hash();
  std::set<std::string> hashes{base};
  for (const char* more : {"    friction: 0.6\n", "    max_normal_N: 2000\n",
                           "    points: [[0.1, 0.05, 0], [0.1, -0.05, 0], [-0.1, 0, 0]]\n"}) {
    Use(Contacts(more));
    EXPECT_TRUE(hashes.insert(Load()->content_hash()).second) << more;
  }
  std::string turned = Contacts();
  turned.replace(turned.find("[0, 0, -0.051]}"), 15, "[0, 0, -0.051], rpy: [0, 0, 0.1]}");
  Use(turned);
  EXPECT_TRUE(hashes.insert(Load()->content_hash()).second);
}

TEST_F(ContactTest, StancesUseNamesNotLinks) {
  std::string contacts = Contacts();
  contacts.replace(contacts.find("l_foot:"), 7, "left:");
  Use(contacts);
  EXPECT_THAT(MessageOf([&] { Load(); }), AllOf(HasSubstr("l_foot"), HasSubstr("no such contact")));
  for (const char* file : {"problems-posture.json", "problems-motion.json"}) {
    std::string text = test::ReadText(folder_.path() / file);
    for (size_t at = 0; (at = text.find("l_foot", at)) != std::string::npos;) text.replace(at, 6, "left");
    WriteText(folder_.path() / file, text);
  }
  WriteManifestHashes(folder_.path());
  const auto dataset = Load();
  EXPECT_EQ(dataset->contacts()[0].name, "left");
  EXPECT_EQ(dataset->contact("left").link, "l_foot");
  EXPECT_EQ(dataset->problem(Task::kPosture, 0).stances[0].contacts[0].contact, "left");
}

TEST_F(ContactTest, LinkTargetPutsTheContactFrameOnItsTarget) {
  ContactDescription description;
  description.position = {0.1, -0.02, -0.08};
  description.rpy_rad = {0.3, -0.2, 1.1};
  const Contact contact = ResolveContact(description, 0, {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)});
  const ContactTarget target{
      .contact = "",
      .position = {1, 2, 3},
      .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()))};
  const Eigen::Isometry3d X_WC = contact.LinkTarget(target) * contact.X_LC;
  EXPECT_LT((X_WC.translation() - target.position).norm(), 1e-14);
  EXPECT_LT((X_WC.linear() - target.rotation.toRotationMatrix()).norm(), 1e-14);
}

TEST_F(ContactTest, FrameFollowsUrdfsRollPitchYaw) {
  ContactDescription description;
  description.rpy_rad = {0, std::numbers::pi / 2, 0};
  const Contact pitched = ResolveContact(description, 0, {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)});
  EXPECT_LT((pitched.X_LC.linear() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-14);
  description.rpy_rad = {std::numbers::pi / 2, 0, std::numbers::pi / 2};  // roll first, then yaw about the fixed z axis
  const Contact both = ResolveContact(description, 0, {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)});
  EXPECT_LT((both.X_LC.linear() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-14);
}

TEST_F(ContactTest, DeclaredPointsSpanTheSupportPolygon) {
  Use(Contacts("    points: [[0.3, 0, 0], [-0.1, 0.02, 0], [-0.1, -0.02, 0]]\n"));
  const auto dataset = Load();
  Stance left = dataset->problem(Task::kPosture, 0).stances[0];
  left.contacts.resize(1);
  const auto polygon = TargetSupportPolygon(*dataset, left);
  ASSERT_EQ(polygon.size(), 3u);
  double front = -1;
  for (const Eigen::Vector2d& corner : polygon) front = std::max(front, corner.x());
  EXPECT_NEAR(front, 0.3, 1e-12);
  EXPECT_NEAR(dataset->contacts()[0].Patch().sizes().x(), 0.4, 1e-12);
}

TEST_F(ContactTest, WrittenFilesReadTheSame) {
  Use(
      Contacts("    points: [[0.3, 0, 0.001], [-0.1, 0.02, 0], [-0.1, -0.02, 0]]\n    friction: 0.45\n"
               "    max_normal_N: 1500\n"));
  const DatasetDescription description = ReadDatasetFile(folder_.path());
  const test::TemporaryFolder other;
  WriteText(other.path() / "dataset.yaml", FormatDatasetFile(description, ""));
  EXPECT_EQ(ReadDatasetFile(other.path()).contacts, description.contacts);
  EXPECT_THAT(FormatDatasetFile(description, ""), HasSubstr("format: legopt-dataset/2"));
  DatasetDescription soles = description;
  soles.contacts = DescribeSoles({"l_foot", "r_foot"}, 0.051);
  EXPECT_THAT(FormatDatasetFile(soles, ""), AllOf(HasSubstr("format: legopt-dataset/1"), HasSubstr(kFormat1)));
}

TEST_F(ContactTest, TheTrunkIsALinkAndPartOfTheHash) {
  const std::string base = Load()->content_hash();
  Use(Contacts() + "trunk: l_foot\n");
  const auto dataset = Load();
  EXPECT_NE(dataset->content_hash(), base);
  EXPECT_EQ(dataset->robot().links()[static_cast<std::size_t>(dataset->trunk().link)].name, "l_foot");
  EXPECT_NEAR(dataset->trunk_height_m(), 0.05, 1e-9) << "of the foot's link frame above the lower corners of its box";
  EXPECT_THAT(FormatDatasetFile(ReadDatasetFile(folder_.path()), ""), HasSubstr("\ntrunk: l_foot\n"));
  EXPECT_THAT(MessageWith(Contacts() + "trunk: l_foo\n"),
              AllOf(HasSubstr("trunk"), HasSubstr("did you mean 'l_foot'?")));
}

TEST_F(ContactTest, ErrorsNameTheKey) {
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string contacts = Contacts();
    contacts.replace(contacts.find(from), from.size(), to);
    return MessageWith(contacts);
  };
  EXPECT_THAT(with("kind: sole", "kind: soel"),
              AllOf(HasSubstr("contacts.l_foot.kind: is no kind of contact"), HasSubstr("did you mean 'sole'?")));
  EXPECT_THAT(with("    kind: sole\n", ""), HasSubstr("contacts.l_foot.kind: the key is missing"));
  EXPECT_THAT(with("link: l_foot", "link: l_fot"),
              AllOf(HasSubstr("contacts.l_foot.link: the robot has no such link"), HasSubstr("l_foot")));
  EXPECT_THAT(with("link: l_foot", "link: camera"), HasSubstr("no collision geometry"));
  EXPECT_THAT(with("position: [0, 0, -0.051]", "position: [0, -0.051]"),
              HasSubstr("contacts.l_foot.frame.position: must be three finite numbers"));
  EXPECT_THAT(with("position", "positon"), HasSubstr("did you mean 'position'?"));
  EXPECT_THAT(with("  l_foot:", "  'l,foot':"), HasSubstr("neither comma nor blank"));
  EXPECT_THAT(MessageWith("contacts: {}\n"), HasSubstr("contacts: must declare at least one contact"));
  EXPECT_THAT(MessageWith(""), HasSubstr("contacts: the key is missing"));
  EXPECT_THAT(MessageWith(kFormat1), HasSubstr("feet: unknown key"));
  EXPECT_THAT(MessageWith(Contacts("    friction: 0\n")), HasSubstr("contacts.l_foot.friction: must lie in (0, 2]"));
  EXPECT_THAT(MessageWith(Contacts("    max_normal_N: -1\n")), HasSubstr("max_normal_N: must be greater than 0"));
  EXPECT_THAT(MessageWith(Contacts("    points: [[0, 0, 0], [1, 0, 0]]\n")), HasSubstr("a list of 3 to 64 points"));
  EXPECT_THAT(MessageWith(Contacts("    points: [[0, 0, 0], [1, 0, 0], [1, 1]]\n")),
              HasSubstr("contacts.l_foot.points[2]: must be three finite numbers"));
  EXPECT_THAT(MessageWith(Contacts("    points: [[0, 0, 0], [1, 0, -1], [1, 1, 0]]\n")),
              HasSubstr("contacts.l_foot.points[1]: lies below the surface"));
  EXPECT_THAT(MessageWith(Contacts("    points: [[0, 0, 0], [1, 0, 0], [0, 0, 0], [1, 1, 0]]\n")),
              HasSubstr("contacts.l_foot.points[2]: is the same point as points[0]"));
  EXPECT_THAT(MessageWith(Contacts("    points: [[0, 0, 0], [1, 0, 0], [2, 0, 0]]\n")),
              HasSubstr("contacts.l_foot.points: lie on one line"));
  EXPECT_THAT(MessageWith(Contacts("    points: [[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]]\n")),
              AllOf(HasSubstr("contacts.l_foot.points: the edges from points[0] and points[2] cross"),
                    HasSubstr("in their order around the patch")));
  EXPECT_THAT(MessageWith(Contacts("    radius_m: 0.1\n")),
              HasSubstr("contacts.l_foot.radius_m: is for contacts of kind 'point' or 'rail'"));
  EXPECT_THAT(MessageWith(Contacts("    max_force_N: 100\n")), HasSubstr("is for contacts of kind 'rail'"));
}

/// A palm and a grip on the arms of the synthetic robot.
constexpr const char* kHands = R"(  palm:
    link: l_arm
    kind: palm
    frame: {position: [0, 0.031, -0.3], rpy: [1.5707963267948966, 0, 0]}
    points: [[0.02, 0.02, 0], [-0.02, 0.02, 0], [-0.02, -0.02, 0], [0.02, -0.02, 0]]
    friction: 0.4
  grip:
    link: r_arm
    kind: rail
    frame: {position: [0, 0, -0.45]}
    points: [[0.03, 0, 0], [-0.03, 0, 0]]
    radius_m: 0.02
    slide_m: 0.1
    max_force_N: 200
)";

TEST_F(ContactTest, HandsAreContactsOnAnyLink) {
  Use(Contacts() + kHands);
  const auto dataset = Load();
  ASSERT_EQ(dataset->contacts().size(), 4u);
  EXPECT_EQ(dataset->contact("palm").link, "l_arm");
  EXPECT_EQ(dataset->contact("grip").max_force_N, 200.0);
  EXPECT_EQ(dataset->contact("grip").slide_m, 0.1);
  ASSERT_EQ(dataset->feet().size(), 2u) << "plans walk on soles and points";
  EXPECT_EQ(dataset->feet()[1].name, "r_foot");
  EXPECT_NEAR(dataset->nominal_sole_height_m(), -0.55, 0.1) << "hands do not count";

  const DatasetDescription description = ReadDatasetFile(folder_.path());
  const test::TemporaryFolder other;
  WriteText(other.path() / "dataset.yaml", FormatDatasetFile(description, ""));
  EXPECT_EQ(ReadDatasetFile(other.path()).contacts, description.contacts);

  std::set<std::string> hashes{dataset->content_hash()};
  for (const auto& [from, to] : {std::pair("slide_m: 0.1", "slide_m: 0.2"),
                                 {"max_force_N: 200", "max_force_N: 201"},
                                 {"kind: palm", "kind: sole"}}) {
    std::string hands = kHands;
    hands.replace(hands.find(from), std::string(from).size(), to);
    Use(Contacts() + hands);
    EXPECT_TRUE(hashes.insert(Load()->content_hash()).second) << to;
  }
}

TEST_F(ContactTest, ErrorsOfHandsNameTheKey) {
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string hands = kHands;
    hands.replace(hands.find(from), from.size(), to);
    return MessageWith(Contacts() + hands);
  };
  EXPECT_THAT(with("    max_force_N: 200\n", ""), HasSubstr("contacts.grip.max_force_N: the key is missing"));
  EXPECT_THAT(with("max_force_N: 200", "max_force_N: 0"), HasSubstr("max_force_N: must be greater than 0"));
  EXPECT_THAT(with("slide_m: 0.1", "slide_m: -1"), HasSubstr("contacts.grip.slide_m: must lie in [0, 1]"));
  EXPECT_THAT(with("[-0.03, 0, 0]", "[-0.03, 0.01, 0]"),
              AllOf(HasSubstr("contacts.grip.points[1]: lies beside the x axis"), HasSubstr("[x, 0, 0]")));
  EXPECT_THAT(with("    points: [[0.03, 0, 0], [-0.03, 0, 0]]\n", ""),
              HasSubstr("contacts.grip.points: the key is missing"));
  EXPECT_THAT(with("max_force_N: 200", "max_force_N: 200\n    friction: 0.5"),
              HasSubstr("contacts.grip.friction: is for contacts of kind 'sole' or 'point' or 'palm'"));
  EXPECT_THAT(with("    points: [[0.02, 0.02, 0], [-0.02, 0.02, 0], [-0.02, -0.02, 0], [0.02, -0.02, 0]]\n", ""),
              HasSubstr("contacts.palm.points: the key is missing"));
  EXPECT_THAT(with("link: l_arm", "link: l_hand"), HasSubstr("contacts.palm.link: the robot has no such link"));
  EXPECT_THAT(MessageWith(Contacts() + kHands + "support: [l_foot, palm]\n"),
              AllOf(HasSubstr("support: is of kind 'palm'"), HasSubstr("sole or point")));
  EXPECT_THAT(MessageWith(Contacts() + kHands + "support: [l_fot]\n"), HasSubstr("did you mean 'l_foot'?"));
  EXPECT_THAT(MessageWith(std::string("contacts:\n") + kHands), HasSubstr("no contact is of kind sole or point"));
}

TEST_F(ContactTest, LimitsOfJointsReplaceThoseOfTheRobotFile) {
  const std::string base = Load()->content_hash();
  Use(Contacts() + "effort_limits: {l_hip: 42.5}\nvelocity_limits: {neck: 0.1}\n");
  const auto dataset = Load();
  EXPECT_NE(dataset->content_hash(), base);
  EXPECT_EQ(dataset->robot().effort_limits()[test::kLeftHip], 42.5);
  EXPECT_EQ(dataset->robot().effort_limits()[test::kRightHip], 100.0);
  EXPECT_EQ(dataset->robot().velocity_limits()[test::kNeck], 0.1);
  EXPECT_THAT(FormatDatasetFile(ReadDatasetFile(folder_.path()), ""), HasSubstr("\neffort_limits:\n  l_hip: 42.5\n"));
  EXPECT_THAT(MessageWith(Contacts() + "effort_limits: {l_hip: 0}\n"),
              AllOf(HasSubstr("effort_limits.l_hip: must be greater than 0"), HasSubstr("keep the URDF's")));
  EXPECT_THAT(
      MessageWith(Contacts() + "effort_limits: {l_hop: 3}\n"),
      AllOf(HasSubstr("effort_limits: the robot has no such movable joint"), HasSubstr("did you mean 'l_hip'?")));
}

TEST_F(ContactTest, PlantedFeetAreThoseOfBothAtTheSameTarget) {
  const auto dataset = Load();
  const auto foot = [](const char* link, double x) {
    return ContactTarget{.contact = link, .position = {x, 0, 0}, .rotation = Eigen::Quaterniond::Identity()};
  };
  const Stance both{{foot("l_foot", 0), foot("r_foot", 0.1)}};
  const Stance stepped{{foot("r_foot", 0.3), foot("l_foot", 0)}};
  const Stance right{{foot("r_foot", 0.1)}};
  const Stance none = PlantedContacts(*dataset, right, stepped);
  EXPECT_TRUE(PlantedContacts(*dataset, both, both) == both);
  EXPECT_TRUE(PlantedContacts(*dataset, both, stepped) == Stance{{foot("l_foot", 0)}});
  EXPECT_TRUE(PlantedContacts(*dataset, right, both) == right);
  EXPECT_TRUE(PlantedContacts(*dataset, both, right) == right);
  EXPECT_TRUE(none.contacts.empty());
  Stance turned = right;
  turned.contacts[0].rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()));
  EXPECT_TRUE(PlantedContacts(*dataset, right, turned).contacts.empty());
}

TEST_F(ContactTest, PlantedContactsKeepWhatBothStancesAllow) {
  Use(Contacts() + kHands);
  const auto dataset = Load();
  const auto at = [](const char* name) {
    return ContactTarget{
        .contact = name, .position = Eigen::Vector3d::Zero(), .rotation = Eigen::Quaterniond::Identity()};
  };
  Stance from{{at("l_foot"), at("palm"), at("grip")}, 10.0}, to = from;
  from.contacts[1].friction = 0.9;  // the palm's own is 0.4
  from.contacts[2].slide_m = 0.3;   // the grip's own is 0.1
  to.contacts[0].carries = false;
  const Stance planted = PlantedContacts(*dataset, from, to);
  ASSERT_EQ(planted.contacts.size(), 3u);
  EXPECT_FALSE(planted.contacts[0].carries);
  EXPECT_EQ(planted.contacts[1].friction, 0.4);
  EXPECT_EQ(planted.contacts[2].slide_m, 0.1);
  EXPECT_FALSE(planted.push_N);
}

TEST_F(ContactTest, StancesStateOnlyWhatTheKindHas) {
  Use(Contacts() + kHands);
  const auto pose = [&](const std::string& more) {
    WriteText(folder_.path() / "problems-posture.json",
              R"({"task": "posture", "problems": [{"id": 0, "definition": [{"contacts": )"
              R"("l_foot,1 0 0 0 0 0.1 0 ,palm,1 0 0 0 0 0.4 1 ,grip,1 0 0 0 0 -0.4 1 ,", )" +
                  more + "}]}]}");
    WriteManifestHashes(folder_.path());
  };
  pose(R"("friction": {"palm": 0.3}, "slide_m": {"grip": 0.2})");
  EXPECT_EQ(Load()->problem(Task::kPosture, 0).stances[0].contacts[1].friction, 0.3);
  pose(R"("friction": {"grip": 0.3})");
  EXPECT_THAT(MessageOf([&] { Load(); }), HasSubstr("friction.grip: contacts of this kind have no friction"));
  pose(R"("slide_m": {"palm": 0.3})");
  EXPECT_THAT(MessageOf([&] { Load(); }), HasSubstr("slide_m.palm: contacts of this kind have no slide_m"));
}

}  // namespace
}  // namespace legopt
