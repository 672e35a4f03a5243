#include <gmock/gmock.h>

// Returns 77, which CTest and scripts interpret as "skipped", if tests were skipped and none ran.
int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  const int status = RUN_ALL_TESTS();
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  constexpr int kSkipped = 77;
  return status == 0 && all.skipped_test_count() > 0 && all.successful_test_count() == 0 ? kSkipped : status;
}
