// Policy: contact sequences of multicontact-api keep contacts, placements, friction and order. What legopt writes, it
// reads back with the same bits; what others write, it reads or refuses by name. step.xml has the elements in the order
// in which multicontact-api's serialization writes them (include/multicontact-api/scenario, versions 2 and 3); it was
// written for these tests.
#include "legopt/import/contact_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string StepText() { return test::ReadText(SourceFolder() + "/tests/import/step.xml"); }

class ContactSequences : public testing::Test {
 protected:
  ContactSequences() : synthetic_(folder_.path() / "dataset"), dataset_(Dataset::Load(synthetic_.path())) {}

  ContactSequence Read(const std::string& text) {
    test::WriteText(folder_ / "sequence.xml", text);
    return ReadContactSequence(folder_ / "sequence.xml");
  }
  ImportedSequence Import(const std::string& text, const std::map<std::string, std::string>& effectors = {}) {
    return StancesOf(Read(text), *dataset_, effectors, "sequence.xml");
  }
  /// Returns the error for step.xml with every match of an expression replaced.
  std::string ErrorWith(const std::string& from, const std::string& to) {
    const std::string text = std::regex_replace(StepText(), std::regex(from), to);
    EXPECT_NE(text, StepText()) << from;
    return test::MessageOf([&] { Import(text); });
  }

  test::TemporaryFolder folder_;
  test::SyntheticFolder synthetic_;
  std::shared_ptr<const Dataset> dataset_;
};

/// Returns the sequence without the comment that legopt adds.
std::string WithoutComment(const std::string& text) { return text.substr(0, text.find("<!-- legopt-stances")); }

TEST_F(ContactSequences, PhasesBecomeStances) {
  const ImportedSequence imported = Import(StepText());
  ASSERT_EQ(imported.stances.size(), 3U);
  const std::vector<ContactTarget>& both = imported.stances[0].contacts;
  ASSERT_EQ(both.size(), 2U);
  EXPECT_EQ(both[0].contact, "r_foot") << "in the order of effector_in_contact";
  EXPECT_EQ(both[1].contact, "l_foot") << "the only contact on the link behind the joint l_ankle";
  EXPECT_EQ(both[0].position, Eigen::Vector3d(0, -0.1, 0));
  EXPECT_EQ(both[0].rotation.coeffs(), Eigen::Quaterniond::Identity().coeffs());
  EXPECT_EQ(both[0].friction, std::nullopt) << "that of the contact itself";
  EXPECT_EQ(imported.stances[1].contacts.size(), 1U);
  const ContactTarget& moved = imported.stances[2].contacts[1];
  EXPECT_EQ(moved.position, Eigen::Vector3d(0.125, 0.1, 0.03125));
  EXPECT_TRUE((moved.rotation * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d(0.8, 0.6, 0), 1e-15))
      << "rotations are stored column by column";
  EXPECT_EQ(moved.friction, 0.5);
  EXPECT_THAT(imported.warnings, IsEmpty()) << "type and points are those of the contacts";
}

TEST_F(ContactSequences, ReadsConfigurationsAndIgnoresTrajectories) {
  const ContactSequence sequence = Read(StepText());
  EXPECT_EQ(sequence.phases[0].first, (Eigen::VectorXd(7) << 0, 0, 0.551, 0, 0, 0, 1).finished());
  EXPECT_EQ(sequence.phases[0].last.size(), 0);
  EXPECT_EQ(sequence.phases[1].first.size(), 0);
  EXPECT_THAT(sequence.stances, IsEmpty());
}

TEST_F(ContactSequences, FrictionThatWasNeverSetIsThatOfTheContact) {
  const std::string text = std::regex_replace(StepText(), std::regex("<mu>[^<]*"), "<mu>-1.0e+00");
  for (const Stance& stance : Import(text).stances) {
    for (const ContactTarget& target : stance.contacts) EXPECT_EQ(target.friction, std::nullopt);
  }
}

TEST_F(ContactSequences, PatchesOfVersion0HaveFrictionOnly) {
  std::string text =
      std::regex_replace(StepText(), std::regex("<second class_id=\"14\" tracking_level=\"0\" version=\"2\""),
                         "<second class_id=\"14\" tracking_level=\"0\" version=\"0\"");
  text = std::regex_replace(text, std::regex("<contact_model[^>]*>\\n(<mu>.*</mu>)[^]*?</contact_model>"), "$1");
  EXPECT_EQ(Import(text).stances, Import(StepText()).stances);
}

TEST_F(ContactSequences, EffectorsMayHaveTheNameOfALinkOrBeNamed) {
  const std::string by_link = std::regex_replace(StepText(), std::regex("l_ankle"), "l_foot");
  EXPECT_EQ(Import(by_link).stances, Import(StepText()).stances);
  const std::string foreign = std::regex_replace(StepText(), std::regex("l_ankle"), "leg_left_sole_fix_joint");
  EXPECT_EQ(Import(foreign, {{"leg_left_sole_fix_joint", "l_foot"}}).stances, Import(StepText()).stances);
  EXPECT_THAT(test::MessageOf([&] {
                Import(foreign, {{"leg_left_sole_fix_joint", "left_foot"}});
              }),
              AllOf(HasSubstr("--effectors"), HasSubstr("no contact 'left_foot'"), HasSubstr("'l_foot'")));
  EXPECT_THAT(test::MessageOf([&] {
                Import(StepText(), {{"l_ankle", "r_foot"}});
              }),
              AllOf(HasSubstr("phase 0"), HasSubstr("two effectors are contact 'r_foot'")));
}

TEST_F(ContactSequences, OtherModelsAreWarnedAboutOnce) {
  std::string text = std::regex_replace(StepText(), std::regex("<contact_type>1"), "<contact_type>2");
  text = std::regex_replace(text, std::regex("1.30000000000000004e-01"), "2.0e-01");
  EXPECT_THAT(Import(text).warnings,
              ElementsAre(AllOf(HasSubstr("r_foot"), HasSubstr("type is point"), HasSubstr("is a sole")),
                          AllOf(HasSubstr("r_foot"), HasSubstr("4 points differ")), HasSubstr("l_ankle"),
                          HasSubstr("l_ankle")));
}

TEST_F(ContactSequences, WhatIsWrittenIsReadWithTheSameBits) {
  std::size_t stances = 0;
  for (const std::string name : {"hands-small", "contacts-humanoid", "quadruped-rubble"}) {
    const auto dataset = Dataset::Load(SourceFolder() + "/data/" + name);
    for (const Task task : {Task::kPosture, Task::kMotion}) {
      for (const ProblemDefinition& problem : dataset->problems(task)) {
        const std::string text = FormatContactSequence(SequenceOf(*dataset, problem.stances));
        const ContactSequence read = Read(text);
        EXPECT_EQ(StancesOf(read, *dataset, {}, "").stances, problem.stances) << name << " " << problem.id;
        EXPECT_EQ(FormatContactSequence(read), text);
        stances += problem.stances.size();
        // Without the comment, the patches alone give the same placements up to rounding, and the same friction.
        const ImportedSequence plain = StancesOf(Read(WithoutComment(text)), *dataset, {}, "");
        const ContactSequence again = SequenceOf(*dataset, plain.stances);
        for (std::size_t i = 0; i < again.phases.size(); ++i) {
          const auto& patches = again.phases[i].patches;
          ASSERT_EQ(patches.size(), read.phases[i].patches.size());
          for (std::size_t k = 0; k < patches.size(); ++k) {
            SequencePatch patch = patches[k];
            EXPECT_TRUE(patch.rotation.isApprox(read.phases[i].patches[k].rotation, 1e-15));
            patch.rotation = read.phases[i].patches[k].rotation;
            EXPECT_EQ(patch, read.phases[i].patches[k]);
          }
        }
      }
    }
  }
  EXPECT_GT(stances, 300U);
}

TEST_F(ContactSequences, KeepsTouchingContactsSlidesPushesAndNamesWithDashes) {
  const auto hands = Dataset::Load(SourceFolder() + "/data/hands-small");
  Stance stance = hands->problems(Task::kPosture).front().stances.front();
  ASSERT_GE(stance.contacts.size(), 3U);
  stance.contacts.back().carries = false;
  stance.contacts.front().friction = hands->contact(stance.contacts.front().contact).friction;
  stance.push_N = 0.1 + 0.2;
  const ContactSequence sequence = SequenceOf(*hands, std::vector<Stance>{stance});
  EXPECT_EQ(sequence.phases[0].patches.size() + 1, stance.contacts.size()) << "a phase has the contacts that carry";
  EXPECT_THAT(StancesOf(Read(FormatContactSequence(sequence)), *hands, {}, "").stances, ElementsAre(stance));

  ContactSequence dashed = sequence;
  dashed.stances[0].contacts[0].contact = "a---b--";
  const std::string text = FormatContactSequence(dashed);
  const std::string comment = text.substr(text.find("<!-- ") + 5);
  EXPECT_EQ(comment.find("--"), comment.rfind("-->")) << comment;
  EXPECT_EQ(Read(text).stances, dashed.stances);
}

TEST_F(ContactSequences, EditedPatchesCount) {
  const std::vector<Stance>& stances = dataset_->problems(Task::kMotion).front().stances;
  std::string text = FormatContactSequence(SequenceOf(*dataset_, stances));
  const std::string number = "1.00000000000000006e-01";
  text.replace(text.find(number), number.size(), "1.25000000000000000e-01");
  const std::vector<Stance> read = Import(text).stances;
  ASSERT_EQ(read.size(), stances.size());
  EXPECT_EQ(read[0].contacts[0].position, Eigen::Vector3d(0, 0.125, 0));
  EXPECT_EQ(read[1], stances[1]);
}

TEST_F(ContactSequences, ConfigurationsAreInPinocchiosOrder) {
  Eigen::VectorXd x(test::kSyntheticDofs + 7);
  x << 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.07, 0.8, 1, 2, 3, 0.5, -0.5, 0.5, 0.5;
  // l_hip l_ankle, l_shoulder, neck, lidar as cosine and sine, r_hip r_ankle, r_shoulder
  const Eigen::VectorXd expected = (Eigen::VectorXd(16) << 1, 2, 3, -0.5, 0.5, 0.5, 0.5, 0.1, 0.2, 0.5, 0.07,
                                    std::cos(0.8), std::sin(0.8), 0.3, 0.4, 0.6)
                                       .finished();
  EXPECT_EQ(PinocchioConfiguration(dataset_->robot(), x), expected);
  const std::vector<Stance>& stances = dataset_->problems(Task::kMotion).front().stances;
  std::vector<Eigen::VectorXd> waypoints(2 * stances.size(), x);
  waypoints[3][0] = 0.9;
  const ContactSequence read = Read(FormatContactSequence(SequenceOf(*dataset_, stances, waypoints)));
  EXPECT_EQ(read.phases[1].first, expected);
  EXPECT_EQ(read.phases[1].last[7], 0.9);
  EXPECT_EQ(read.phases[2].last, expected);
}

TEST_F(ContactSequences, RefusesOtherArchivesByKind) {
  EXPECT_THAT(test::MessageOf([&] { Read("22 serialization::archive 18 0 2 2 0"); }),
              AllOf(HasSubstr("text archive"), HasSubstr("saveAsXML")));
  EXPECT_THAT(test::MessageOf([&] { Read(std::string("\x16\0\0\0\0\0\0\0serialization::archive\x12", 31)); }),
              AllOf(HasSubstr("binary archive"), HasSubstr("saveAsXML")));
  EXPECT_THAT(test::MessageOf([&] { Read(""); }), HasSubstr("empty"));
  EXPECT_THAT(test::MessageOf([&] { Read("<robot name='a'/>"); }), AllOf(HasSubstr("<robot>"), HasSubstr("archive")));
  EXPECT_THAT(test::MessageOf([&] { Read(StepText().substr(0, 5000)); }), HasSubstr("not well-formed"));
  EXPECT_THAT(test::MessageOf([&] { ReadContactSequence(folder_ / "absent.xml"); }), HasSubstr("absent.xml"));
}

TEST_F(ContactSequences, ErrorsNamePhaseElementValueAndFix) {
  EXPECT_THAT(ErrorWith("l_ankle", "left_toe"),
              AllOf(HasSubstr("phase 0, effector_in_contact"), HasSubstr("'left_toe'"), HasSubstr("--effectors")));
  EXPECT_THAT(ErrorWith("<placement[^]*?</placement>", ""),
              AllOf(HasSubstr("phase 0, effector l_ankle"), HasSubstr("<placement> is missing")));
  EXPECT_THAT(ErrorWith("<first>r_foot", "<first>other"),
              AllOf(HasSubstr("phase 0"), HasSubstr("no placement"), HasSubstr("'r_foot'"), HasSubstr("addContact")));
  EXPECT_THAT(ErrorWith("<mu>5.0*e", "<mu>-5.0e"),
              AllOf(HasSubstr("phase 2, effector l_ankle, mu"), HasSubstr("negative"), HasSubstr("'-5.0e-01'")));
  EXPECT_THAT(ErrorWith("<mu>5.0*e-01", "<mu>2.5"), AllOf(HasSubstr("(0, 2]"), HasSubstr("'2.5'")));
  EXPECT_THAT(ErrorWith("<mu>5.0*e-01", "<mu>much"), AllOf(HasSubstr("finite number"), HasSubstr("'much'")));
  EXPECT_THAT(ErrorWith("<size>3", "<size>0"), AllOf(HasSubstr("size"), HasSubstr("no phases")));
  EXPECT_THAT(ErrorWith("<size>3", "<size>4"), AllOf(HasSubstr("incomplete"), HasSubstr("3 elements")));
  EXPECT_THAT(ErrorWith("<contact_phase class_id=\"1\" tracking_level=\"0\" version=\"2\"",
                        "<contact_phase class_id=\"1\" tracking_level=\"0\" version=\"3\""),
              AllOf(HasSubstr("contact_phase"), HasSubstr("version"), HasSubstr("'3'"), HasSubstr("0 to 2")));
  EXPECT_THAT(ErrorWith("<contact_patches[^]*?</contact_patches>", ""), HasSubstr("<contact_patches> is missing"));
  EXPECT_THAT(ErrorWith("<contact_type>1", "<contact_type>7"), AllOf(HasSubstr("contact_type"), HasSubstr("'7'")));
  EXPECT_THAT(ErrorWith("<item>8.00000000000000044e-01", "<item>0.9"),
              AllOf(HasSubstr("phase 2, effector l_ankle, placement, rotation"), HasSubstr("no rotation")));
  EXPECT_THAT(ErrorWith("<translation><item>[^<]*</item>", "<translation>"), HasSubstr("3 numbers in <translation>"));
  EXPECT_THAT(ErrorWith("<cols>4</cols>", "<cols>5</cols>"),
              AllOf(HasSubstr("contact_points_positions"), HasSubstr("3 x 5")));
  EXPECT_THAT(ErrorWith("<item>r_foot</item>|<item>l_ankle</item>", ""), HasSubstr("no effector in contact"));
  EXPECT_THAT(ErrorWith("</boost_serialization>", "</boost_serialization><!-- legopt-stances [ -->"),
              AllOf(HasSubstr("comment in line"), HasSubstr("damaged")));
}

}  // namespace
}  // namespace legopt
