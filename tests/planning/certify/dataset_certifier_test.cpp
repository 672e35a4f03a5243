// Certification of a whole dataset: the certificate does not depend on the number of threads or on interruptions.

#include <gtest/gtest.h>

#include <atomic>
#include <set>

#include "legopt/planning/certify/certificate.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt::certify {
namespace {

class DatasetCertificate : public testing::Test {
 protected:
  DatasetCertificate() : dataset_(Dataset::Load(SourceFolder() + "/data/garage-small")), catalogue_(*dataset_) {}

  Certificate Certify(int threads, const Certificate* known = nullptr, const CertifyHooks& hooks = {}) const {
    return CertifyDataset(dataset_, catalogue_, {.starts = 60, .threads = threads}, known, hooks);
  }
  std::string Text(const Certificate& certificate) const {
    return FormatCertificate(certificate, catalogue_, *dataset_);
  }

  std::shared_ptr<const Dataset> dataset_;
  StanceCatalogue catalogue_;
};

TEST_F(DatasetCertificate, TheCatalogueHasEveryStanceOnce) {
  std::set<std::string> texts;
  for (const Stance& stance : catalogue_.stances()) EXPECT_TRUE(texts.insert(FormatStance(stance)).second);
  const auto& motions = dataset_->problems(Task::kMotion);
  for (std::size_t p = 0; p < motions.size(); ++p) {
    const auto& numbers = catalogue_.problems(Task::kMotion)[p];
    ASSERT_EQ(numbers.size(), motions[p].stances.size());
    for (std::size_t s = 0; s < numbers.size(); ++s) {
      EXPECT_EQ(catalogue_.stances()[static_cast<std::size_t>(numbers[s])], motions[p].stances[s]);
    }
    const auto& of_first = catalogue_.neighbours(numbers[0]);
    for (const std::size_t near : {1, 2}) {
      EXPECT_NE(std::find(of_first.begin(), of_first.end(), numbers[near]), of_first.end());
    }
    EXPECT_EQ(std::find(of_first.begin(), of_first.end(), numbers[0]), of_first.end());
  }
}

TEST_F(DatasetCertificate, EveryPostureIsAcceptedByTheJudge) {
  const Certificate certificate = Certify(1);
  ASSERT_TRUE(certificate.IsComplete());
  StanceCertifier certifier(dataset_);
  for (std::size_t s = 0; s < certificate.stances.size(); ++s) {
    ASSERT_EQ(certificate.stances[s]->feasibility, Feasibility::kCertified) << s;
    EXPECT_TRUE(certifier.Accepts(catalogue_.stances()[s], certificate.stances[s]->posture)) << s;
  }
  EXPECT_EQ(CountProblems(certificate, catalogue_, Task::kPosture)[Feasibility::kCertified], 40);
  EXPECT_EQ(CountProblems(certificate, catalogue_, Task::kMotion)[Feasibility::kCertified], 4);
}

TEST_F(DatasetCertificate, ThreadsDecideNothing) { EXPECT_TRUE(Text(Certify(1)) == Text(Certify(3))); }

TEST_F(DatasetCertificate, WhatWasInterruptedGoesOnToTheSameEnd) {
  const std::string whole = Text(Certify(1));
  std::atomic<int> asked = 0;
  CertifyHooks hooks;
  hooks.stop = [&asked] { return ++asked > 120; };
  const Certificate part = Certify(2, nullptr, hooks);
  ASSERT_FALSE(part.IsComplete());
  EXPECT_TRUE(std::any_of(part.stances.begin(), part.stances.end(), [](const auto& e) { return e.has_value(); }));
  EXPECT_TRUE(Text(Certify(2, &part)) == whole);
}

TEST_F(DatasetCertificate, PosturesOfAFileAreJudgedAgain) {
  const Certificate honest = Certify(1);
  Certificate forged = honest;
  forged.stances[0]->posture[0] += 1.0;
  forged.stances[1]->feasibility = Feasibility::kInfeasible;
  forged.stances[1]->proof = "none";
  EXPECT_TRUE(Text(Certify(1, &forged)) == Text(honest));
}

TEST_F(DatasetCertificate, MoreIsKnownEveryTimeItIsTold) {
  std::size_t before = 0;
  CertifyHooks hooks;
  hooks.on_update = [&](const Certificate& certificate) {
    const auto known = static_cast<std::size_t>(std::count_if(certificate.stances.begin(), certificate.stances.end(),
                                                              [](const auto& e) { return e.has_value(); }));
    EXPECT_EQ(known, before + 1);
    before = known;
  };
  Certify(3, nullptr, hooks);
  EXPECT_EQ(before, catalogue_.stances().size());
}

/// Posture problems 0 and 7 have the same stance; no posture balances on the left foot, so the motion stays open.
TEST(DatasetCertificateOfAStiffRobot, OneOpenStanceOpensItsProblemsOnly) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  const StanceCatalogue catalogue(*dataset);
  ASSERT_EQ(catalogue.stances().size(), 2U);
  const Certificate few = CertifyDataset(dataset, catalogue, {.starts = 5, .threads = 1}, nullptr, {});
  EXPECT_EQ(CountProblems(few, catalogue, Task::kPosture)[Feasibility::kCertified], 2);
  EXPECT_EQ(CountProblems(few, catalogue, Task::kMotion)[Feasibility::kOpen], 1);
  EXPECT_EQ(few.stances[1]->starts, 5);
  const Certificate more = CertifyDataset(dataset, catalogue, {.starts = 70, .threads = 1}, &few, {});
  EXPECT_EQ(more.stances[1]->starts, 70) << "what is open with fewer starts is tried again";
  const Certificate again = CertifyDataset(dataset, catalogue, {.starts = 5, .threads = 1}, &more, {});
  EXPECT_EQ(again.stances[1]->starts, 70) << "and stays what it is with fewer";
}

}  // namespace
}  // namespace legopt::certify
