// The certificate file: a written file is read back unchanged, and inconsistent content is refused with the name of
// the field.

#include "legopt/planning/certify/certificate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt::certify {
namespace {

using testing::HasSubstr;

class CertificateFile : public testing::Test {
 protected:
  CertificateFile()
      : folder_(temporary_.path() / "dataset"), dataset_(Dataset::Load(folder_.path())), catalogue_(*dataset_) {
    certificate_ = {dataset_->name(), dataset_->content_hash(), {}};
    certificate_.stances.resize(catalogue_.stances().size());
    StanceEvidence found;
    found.feasibility = Feasibility::kCertified;
    found.posture = Eigen::VectorXd::LinSpaced(dataset_->robot().configuration_size(), -1.0, 2.0);
    found.start = 7;
    found.by_neighbour = true;
    certificate_.stances[0] = found;
    StanceEvidence open;
    open.starts = 100;
    open.obstruction = {{{ConstraintGroup::kBalance}, {ConstraintGroup::kSelf, ConstraintGroup::kEnvironment}}, "foot"};
    certificate_.stances[1] = open;
  }

  std::string Write() const {
    test::WriteText(path_, FormatCertificate(certificate_, catalogue_, *dataset_));
    return path_;
  }
  Certificate Read() const { return ReadCertificate(path_, catalogue_, *dataset_); }
  /// Returns the error of reading the file after one text is replaced.
  std::string RefusalOf(const std::string& from, const std::string& to) const {
    Write();
    test::ReplaceInFile(path_, from, to);
    return test::MessageOf([this] { Read(); });
  }

  test::TemporaryFolder temporary_;
  test::SyntheticFolder folder_;
  std::shared_ptr<const Dataset> dataset_;
  StanceCatalogue catalogue_;
  Certificate certificate_;
  std::string path_ = temporary_.path() / "certificate.json";
};

TEST_F(CertificateFile, IsReadBackAsItWas) {
  StanceEvidence infeasible;
  infeasible.feasibility = Feasibility::kInfeasible;
  infeasible.proof = "the legs are too short";
  for (const bool with_proof : {false, true}) {
    if (with_proof) certificate_.stances[1] = infeasible;
    Write();
    const Certificate read = Read();
    EXPECT_EQ(FormatCertificate(read, catalogue_, *dataset_), test::ReadText(path_));
    EXPECT_EQ(read.stances[0]->posture, certificate_.stances[0]->posture);
    EXPECT_EQ(read.stances[0]->start, 7);
    EXPECT_TRUE(read.stances[0]->by_neighbour);
    EXPECT_EQ(read.stances[1]->obstruction.without, certificate_.stances[1]->obstruction.without);
    EXPECT_EQ(read.stances[1]->proof, certificate_.stances[1]->proof);
  }
}

TEST_F(CertificateFile, AProblemIsWhatItsStancesAre) {
  const std::vector<int> both = {0, 1, 0};
  EXPECT_EQ(certificate_.Of({0}), Feasibility::kCertified);
  EXPECT_EQ(certificate_.Of(both), Feasibility::kOpen);
  certificate_.stances[1]->feasibility = Feasibility::kInfeasible;
  EXPECT_EQ(certificate_.Of(both), Feasibility::kInfeasible);
  certificate_.stances[1]->feasibility = Feasibility::kCertified;
  EXPECT_EQ(certificate_.Of(both), Feasibility::kCertified);
  certificate_.stances[0].reset();
  EXPECT_EQ(certificate_.Of(both), Feasibility::kOpen) << "nobody has looked at it";
  EXPECT_FALSE(certificate_.IsComplete());
}

TEST_F(CertificateFile, ProblemsAreReadWithoutTheDataset) {
  const ProblemFeasibility problems = ReadProblemFeasibility(Write());
  EXPECT_EQ(problems.dataset_hash, dataset_->content_hash());
  EXPECT_EQ(problems.dataset, "tiny");
  EXPECT_EQ(problems.problems[Task::kPosture],
            (std::map<int, Feasibility>{{0, Feasibility::kCertified}, {7, Feasibility::kCertified}}));
  EXPECT_EQ(problems.problems[Task::kMotion], (std::map<int, Feasibility>{{0, Feasibility::kOpen}}));
}

TEST_F(CertificateFile, ThatOfAnotherDatasetIsRefusedWithTheFix) {
  Write();
  const std::string other(64, 'a');
  test::ReplaceInFile(path_, dataset_->content_hash(), other);
  try {
    Read();
    FAIL() << "it fits";
  } catch (const CertificateMismatch& error) {
    EXPECT_THAT(error.what(), HasSubstr(path_));
    EXPECT_THAT(error.what(), HasSubstr(other));
    EXPECT_THAT(error.what(), HasSubstr(dataset_->content_hash()));
    EXPECT_THAT(error.what(), HasSubstr("--out"));
  }
}

TEST_F(CertificateFile, DamageIsNamed) {
  EXPECT_THAT(RefusalOf("legopt-certificate/1", "legopt-certificate/2"), HasSubstr("legopt-certificate/1"));
  EXPECT_THAT(RefusalOf("\"neighbour\":7", "\"neighbour\":-7"), HasSubstr("stance 0.neighbour"));
  EXPECT_THAT(RefusalOf("\"x\":[-1.0,", "\"x\":["), HasSubstr("must be a list of 15 numbers"));
  EXPECT_THAT(RefusalOf("[\"balance\"]", "[\"balanse\"]"), HasSubstr("balanse"));
  EXPECT_THAT(RefusalOf("{\"stance\":1", "{\"stance\":2"), HasSubstr("the dataset has stances 0 to 1"));
  EXPECT_THAT(RefusalOf("\"stances\"", "\"stanzas\""), HasSubstr("stances: the key is missing"));
  EXPECT_THAT(RefusalOf("\"starts\":100", "\"starts\":\"many\""), HasSubstr("stance 1.starts"));
}

TEST_F(CertificateFile, WhatIsNoCertificateIsNamed) {
  test::WriteText(path_, "{\"problems\": []}");
  EXPECT_THAT(test::MessageOf([this] { ReadProblemFeasibility(path_); }), HasSubstr("format"));
  test::WriteText(path_, "[1, 2]");
  EXPECT_THAT(test::MessageOf([this] { ReadProblemFeasibility(path_); }), HasSubstr("certificate"));
  test::WriteText(path_, "{");
  EXPECT_THAT(test::MessageOf([this] { ReadProblemFeasibility(path_); }), HasSubstr("not valid JSON"));
}

}  // namespace
}  // namespace legopt::certify
