// Policy: a database is refused on file systems known to lose data, and nowhere else. fuse_test uses a real one.
#include <gtest/gtest.h>
#include <linux/magic.h>

#include <filesystem>

#include "db/database_file.h"

namespace legopt::db {
namespace {

TEST(UnsupportedFileSystemName, NamesThoseOfNetworksAndOfPrograms) {
  constexpr std::int64_t kLustre = 0x0bd00bd0;
  EXPECT_EQ(UnsupportedFileSystemName(NFS_SUPER_MAGIC), "NFS");
  EXPECT_EQ(UnsupportedFileSystemName(SMB2_SUPER_MAGIC), "SMB");
  EXPECT_EQ(UnsupportedFileSystemName(CEPH_SUPER_MAGIC), "Ceph");
  EXPECT_EQ(UnsupportedFileSystemName(V9FS_MAGIC), "9P");
  EXPECT_EQ(UnsupportedFileSystemName(FUSE_SUPER_MAGIC), "FUSE");
  EXPECT_EQ(UnsupportedFileSystemName(kLustre), "Lustre");
}

TEST(UnsupportedFileSystemName, LetsLocalDisksBe) {
  for (const std::int64_t type : std::initializer_list<std::int64_t>{
           EXT4_SUPER_MAGIC, XFS_SUPER_MAGIC, BTRFS_SUPER_MAGIC, TMPFS_MAGIC, OVERLAYFS_SUPER_MAGIC}) {
    EXPECT_EQ(UnsupportedFileSystemName(type), std::nullopt) << std::hex << type;
  }
}

TEST(FileSystemOf, AFileThatIsNotThereYetIsWhereItsFolderIs) {
  EXPECT_EQ(FileSystemOf("/proc/self/status"), PROC_SUPER_MAGIC);
  EXPECT_EQ(FileSystemOf("/proc/no-such-file"), PROC_SUPER_MAGIC);
  EXPECT_EQ(FileSystemOf("/no such folder/file"), std::nullopt);
  EXPECT_NE(FileSystemOf("results.sqlite"), std::nullopt);
}

}  // namespace
}  // namespace legopt::db
