// What happens to a faulty URDF: it is refused, or accepted with a note.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "app/isolated_call.h"
#include "legopt/robot/internal/urdf_check.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/input_error.h"
#include "tests/folders.h"

namespace legopt::test {

/// Returns the first fault of a URDF; an empty one if it is accepted.
inline InputError::Fault FaultOf(const std::string& xml) {
  try {
    RobotModel::FromUrdfText(xml, "robot.urdf", SourceFolder() + "/tests/robot", CallIsolated);
  } catch (const InputError& error) {
    return error.fault();
  }
  return {};
}

/// Expects an error with these words in its field, a line and a fix.
inline void ExpectRefused(const std::string& xml, const std::vector<std::string>& in_field, const std::string& what) {
  const InputError::Fault fault = FaultOf(xml);
  ASSERT_FALSE(fault.message.empty()) << "accepted: " << what;
  EXPECT_EQ(fault.file, "robot.urdf");
  for (const std::string& word : in_field) EXPECT_THAT(fault.field, testing::HasSubstr(word)) << what;
  EXPECT_THAT(fault.field, testing::HasSubstr("line ")) << what;
  EXPECT_FALSE(fault.fix.empty()) << what;
  EXPECT_THAT(fault.message, testing::Not(testing::HasSubstr("urdfdom"))) << what << ": urdfdom saw it";
  EXPECT_LE(fault.value.size(), 60U) << what;
}

/// Expects that the URDF is accepted, with at least one note.
inline void ExpectNoted(const std::string& xml, const std::string& what) {
  EXPECT_EQ(FaultOf(xml).message, "") << what;
  if (!FaultOf(xml).message.empty()) return;
  const std::vector<UrdfDiagnostic> notes = CheckUrdf(xml, "robot.urdf").notes;
  EXPECT_FALSE(notes.empty()) << what;
  for (const UrdfDiagnostic& note : notes)
    EXPECT_THAT(note.field + note.value, testing::Not(testing::HasSubstr("\x1b"))) << what;
}

}  // namespace legopt::test
