// The embedded datasets state which of their problems are feasible, and the judge accepts every posture given as
// evidence.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <optional>

#include "app/data_folder.h"
#include "legopt/dataset/dataset.h"
#include "legopt/planning/certify/certificate.h"
#include "legopt/planning/certify/internal/stance_certifier.h"

namespace legopt {
namespace {

using certify::CountProblems;
using certify::StanceCatalogue;

certify::Certificate EmbeddedCertificate(const Dataset& dataset, const StanceCatalogue& catalogue) {
  return certify::ReadCertificate(dataset.folder() / certify::kCertificateFileName, catalogue, dataset);
}

TEST(EmbeddedCertificates, PosturesAreAcceptedByTheJudge) {
  for (const auto& folder : app::EmbeddedDatasetFolders()) {
    const auto dataset = Dataset::Load(folder);
    const StanceCatalogue catalogue(*dataset);
    const auto certificate = EmbeddedCertificate(*dataset, catalogue);
    EXPECT_TRUE(certificate.IsComplete()) << folder;
    certify::StanceCertifier certifier(dataset);
    for (std::size_t s = 0; s < certificate.stances.size(); ++s) {
      if (certificate.stances[s]->feasibility != Feasibility::kCertified) continue;
      EXPECT_TRUE(certifier.Accepts(catalogue.stances()[s], certificate.stances[s]->posture)) << folder << ' ' << s;
    }
  }
}

TEST(EmbeddedCertificates, WhatIsOpenHasItsReason) {
  const auto dataset = Dataset::Load(app::DefaultDatasetFolder());
  const StanceCatalogue catalogue(*dataset);
  const auto certificate = EmbeddedCertificate(*dataset, catalogue);
  EXPECT_EQ(CountProblems(certificate, catalogue, Task::kPosture)[Feasibility::kCertified], 50);
  EXPECT_EQ(CountProblems(certificate, catalogue, Task::kMotion)[Feasibility::kCertified], 40);
  for (const auto& evidence : certificate.stances) {
    if (evidence->feasibility != Feasibility::kOpen) continue;
    EXPECT_GE(evidence->starts, 10'000);
    EXPECT_FALSE(evidence->obstruction.Describe().empty());
    EXPECT_FALSE(evidence->obstruction.nearest.empty());
  }
}

// Plans were kept only if all stances have a posture (generate --certified); half of them change floors.
TEST(EmbeddedCertificates, AllProblemsOfTheHardGarageAreCertified) {
  const auto dataset = Dataset::Load(app::EmbeddedDatasetFolders().at(1));
  EXPECT_EQ(dataset->name(), "garage-hard");
  const StanceCatalogue catalogue(*dataset);
  const auto certificate = EmbeddedCertificate(*dataset, catalogue);
  EXPECT_EQ(CountProblems(certificate, catalogue, Task::kPosture)[Feasibility::kCertified], 30);
  EXPECT_EQ(CountProblems(certificate, catalogue, Task::kMotion)[Feasibility::kCertified], 24);
  int between_floors = 0;
  for (const ProblemDefinition& problem : dataset->problems(Task::kMotion)) {
    const auto height = [](const Stance& stance) { return stance.contacts.at(0).position.z(); };
    between_floors += std::abs(height(problem.stances.back()) - height(problem.stances.front())) >= 1.5 ? 1 : 0;
  }
  EXPECT_EQ(between_floors, 12);
}

}  // namespace
}  // namespace legopt
