// A key file is accepted only if it is a regular file of the own user, unreadable for others, that holds one key.
#include "bus/message_key.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>

#include "bus/bus_error.h"
#include "bus/lcm_transport.h"
#include "tests/temporary_folder.h"

namespace legopt::bus {
namespace {

class KeyFile : public testing::Test {
 protected:
  std::string Write(const std::string& text, ::mode_t mode = 0600) const {
    const std::string file = folder() / "key";
    std::filesystem::remove(file);
    std::ofstream(file) << text;
    ::chmod(file.c_str(), mode);
    return file;
  }
  const std::filesystem::path& folder() const { return folder_.path(); }
  // Returns the message of the refusal; empty if the file is accepted.
  static std::string Fault(const std::string& file) {
    try {
      MessageKey::Load(file);
    } catch (const BusError& error) {
      EXPECT_EQ(error.code(), BusErrorCode::kInvalidOption);
      EXPECT_NE(std::string(error.what()).find(file), std::string::npos) << error.what();
      return error.what();
    }
    return {};
  }
  static void ExpectFault(const std::string& file, const std::string& word) {
    EXPECT_NE(Fault(file).find(word), std::string::npos) << Fault(file);
  }

  test::TemporaryFolder folder_;
};

const std::string kDigits = "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1F";

TEST_F(KeyFile, IsHexadecimalTextWithOrWithoutALineEnd) {
  for (const char* end : {"", "\n", "\r\n"}) {
    const auto key = MessageKey::Load(Write(kDigits + end));
    ASSERT_NE(key, nullptr);
    for (std::size_t i = 0; i < MessageKey::kBytes; ++i) EXPECT_EQ(key->bytes()[i], i);
  }
}

// A credential granted by systemd has group bits, which are the mask of an access control list, and its folder is
// closed to others.
TEST_F(KeyFile, OfSystemdMayBeReadableByAGroup) {
  const std::string file = Write(kDigits, 0440);
  ASSERT_EQ(::chmod(folder().c_str(), 0750), 0);
  ExpectFault(file, "chmod 600");
  ::setenv("CREDENTIALS_DIRECTORY", folder().c_str(), 1);
  EXPECT_EQ(Fault(file), "");
  ::setenv("CREDENTIALS_DIRECTORY", (folder().string() + "/").c_str(), 1);
  EXPECT_EQ(Fault(file), "");
  for (const ::mode_t mode : {0444U, 0460U, 0450U}) {
    ASSERT_EQ(::chmod(file.c_str(), mode), 0);
    ExpectFault(file, "chmod 600");
  }
  ASSERT_EQ(::chmod(file.c_str(), 0440), 0);
  ASSERT_EQ(::chmod(folder().c_str(), 0755), 0);
  ExpectFault(file, "chmod 600");
  ASSERT_EQ(::chmod(folder().c_str(), 0750), 0);
  ::setenv("CREDENTIALS_DIRECTORY", (folder() / "..").c_str(), 1);
  ExpectFault(file, "chmod 600");
  ::unsetenv("CREDENTIALS_DIRECTORY");
}

TEST_F(KeyFile, MayExistInMemoryOnly) {
  const int fd = MessageKey::Random()->WriteInMemory();
  ASSERT_GE(fd, 3);
  const std::string name = "/dev/fd/" + std::to_string(fd);
  const auto first = MessageKey::Load(name);
  const auto again = MessageKey::Load(name);
  EXPECT_TRUE(std::ranges::equal(first->bytes(), again->bytes()));
  const int other = MessageKey::Random()->WriteInMemory();
  EXPECT_FALSE(std::ranges::equal(first->bytes(), MessageKey::Load("/dev/fd/" + std::to_string(other))->bytes()));
  ::close(other);
  // A descriptor that is passed on purpose must not be inherited by programs started later.
  ASSERT_EQ(::fcntl(fd, F_SETFD, 0), 0);
  MessageKey::Load(name);
  EXPECT_EQ(::fcntl(fd, F_GETFD), FD_CLOEXEC);
  ::close(fd);
  ExpectFault(name, "cannot be opened");
}

TEST_F(KeyFile, OfARoleNamesTheRole) {
  const auto full = MessageKey::Load(Write(kDigits));
  EXPECT_EQ(full->role(), KeyRole::kOperator);
  for (const KeyRole role : kDerivedRoles) {
    const auto derived = MessageKey::Load(Write(full->ForRole(role)->FileText()));
    EXPECT_EQ(derived->role(), role);
    EXPECT_TRUE(std::ranges::equal(derived->bytes(), full->ForRole(role)->bytes()));
    EXPECT_FALSE(std::ranges::equal(derived->bytes(), full->bytes()));
    for (const KeyRole other : {KeyRole::kOperator, KeyRole::kWorker, KeyRole::kClient}) {
      EXPECT_EQ(derived->ForRole(other), other == role ? derived.get() : nullptr);
    }
    const int fd = derived->WriteInMemory();
    EXPECT_EQ(MessageKey::Load("/dev/fd/" + std::to_string(fd))->role(), role);
    ::close(fd);
  }
  EXPECT_EQ(MessageKey::Load(Write(full->FileText()))->role(), KeyRole::kOperator);
  for (const std::string& text : {"operator " + kDigits, "worker" + kDigits, "worker  " + kDigits, "Worker " + kDigits,
                                  "worker client " + kDigits, std::string("worker "), "worker " + kDigits.substr(1),
                                  "worker\t" + kDigits, "client " + kDigits + "00", kDigits + " worker"}) {
    ExpectFault(Write(text), "64 hexadecimal digits");
  }
}

TEST_F(KeyFile, MustHoldExactlyOneKey) {
  for (const std::string& text :
       {std::string(), std::string("\n"), kDigits.substr(2), kDigits.substr(1), kDigits + "00", kDigits + "\n\n",
        " " + kDigits.substr(1), "g" + kDigits.substr(1), kDigits.substr(0, 62) + ":0", std::string(100'000, '0')}) {
    ExpectFault(Write(text), "64 hexadecimal digits");
  }
}

TEST_F(KeyFile, MustNotBeOpenToOthers) {
  for (const ::mode_t mode : {0640, 0604, 0620, 0610, 0601, 0602, 0666}) ExpectFault(Write(kDigits, mode), "chmod 600");
  EXPECT_EQ(Fault(Write(kDigits, 0400)), "");
}

TEST_F(KeyFile, MustBeARegularFile) {
  ExpectFault(folder(), "not a regular file");
  const std::string pipe = folder() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  ExpectFault(pipe, "not a regular file");
  ExpectFault("/dev/zero", "not a regular file");
  ExpectFault(folder() / "missing", "legopt service keygen");
}

TEST_F(KeyFile, MustBelongToUs) {
  const std::string file = Write(kDigits);
  if (::chown(file.c_str(), 12345, 12345) != 0) {
    GTEST_SKIP() << "NOT TESTED: giving a file away is refused: " << std::strerror(errno);
  }
  ExpectFault(file, "12345");
}

TEST_F(KeyFile, MayBeALinkToOne) {
  const std::string file = Write(kDigits);
  std::filesystem::create_symlink(file, folder() / "link");
  EXPECT_EQ(Fault(folder() / "link"), "");
}

TEST_F(KeyFile, IsMadeFreshPrivateAndOnlyOnce) {
  const std::string file = folder() / "new", second = folder() / "second";
  MessageKey::Random()->WriteFile(file);
  MessageKey::Random()->WriteFile(second);
  struct stat status {};
  ASSERT_EQ(::stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  const auto bytes = [](const std::string& f) {
    const auto key = MessageKey::Load(f);
    return std::vector<std::uint8_t>(key->bytes().begin(), key->bytes().end());
  };
  EXPECT_NE(bytes(file), bytes(second));
  EXPECT_THROW(MessageKey::Random()->WriteFile(file), BusError);
  EXPECT_THROW(MessageKey::Random()->WriteFile(folder() / "no" / "folder"), BusError);
}

TEST_F(KeyFile, IsNeededToLeaveTheHost) {
  LcmOptions options;
  options.ttl = 1;
  EXPECT_THROW(options.Validate(), BusError);
  options.trust_network = true;
  EXPECT_NO_THROW(options.Validate());
  options.trust_network = false;
  options.key_file = Write(kDigits);
  EXPECT_NO_THROW(options.Validate());
  options.key_file = Write(kDigits, 0644);
  EXPECT_THROW(const LcmTransport transport(options), BusError) << "a bad key is no key";
}

}  // namespace
}  // namespace legopt::bus
