#include "tests/db/faulty_vfs.h"

#include <sqlite3.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

namespace legopt::db {
namespace {

// SQLite passes plain C function pointers without user data, so the state of the only instance is global.
struct State {
  FaultyVfs::Fault fault = FaultyVfs::Fault::kNone;
  std::int64_t first = 0, length = 0, calls = 0, faults = 0;
  sqlite3_vfs* real = nullptr;
  sqlite3_vfs vfs{};
};
State& Shared() {
  static State state;
  return state;
}

// SQLite allocates this with space for the real file after it.
struct File {
  sqlite3_file base;
  sqlite3_file* real() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};
File* Of(sqlite3_file* file) { return reinterpret_cast<File*>(file); }
sqlite3_file* Real(sqlite3_file* file) { return Of(file)->real(); }

// Returns the error code with which this call must fail; SQLITE_OK to proceed.
int Strike(bool is_sync, int io_error) {
  State& state = Shared();
  if (state.fault == FaultyVfs::Fault::kNone || (state.fault == FaultyVfs::Fault::kSyncFailed && !is_sync))
    return SQLITE_OK;
  ++state.calls;
  if (state.calls < state.first || state.calls >= state.first + state.length) return SQLITE_OK;
  ++state.faults;
  return state.fault == FaultyVfs::Fault::kFull && !is_sync ? SQLITE_FULL : io_error;
}

void DieIfArmed() {
  if (Shared().fault == FaultyVfs::Fault::kDie) ::_exit(9);
}

int Write(sqlite3_file* file, const void* data, int size, sqlite3_int64 offset) {
  const int code = Strike(false, SQLITE_IOERR_WRITE);
  if (code == SQLITE_OK) return Real(file)->pMethods->xWrite(Real(file), data, size, offset);
  const bool torn = Shared().fault == FaultyVfs::Fault::kDie || Shared().fault == FaultyVfs::Fault::kFull;
  if (torn) Real(file)->pMethods->xWrite(Real(file), data, size / 2, offset);
  DieIfArmed();
  return code;
}
int Sync(sqlite3_file* file, int flags) {
  const int code = Strike(true, SQLITE_IOERR_FSYNC);
  if (code == SQLITE_OK) return Real(file)->pMethods->xSync(Real(file), flags);
  DieIfArmed();
  return code;
}
int Truncate(sqlite3_file* file, sqlite3_int64 size) {
  const int code = Strike(false, SQLITE_IOERR_TRUNCATE);
  if (code == SQLITE_OK) return Real(file)->pMethods->xTruncate(Real(file), size);
  DieIfArmed();
  return code;
}
int ShmMap(sqlite3_file* file, int page, int size, int extend, void volatile** memory) {
  const int code = extend != 0 ? Strike(false, SQLITE_IOERR_SHMSIZE) : SQLITE_OK;
  if (code == SQLITE_OK) return Real(file)->pMethods->xShmMap(Real(file), page, size, extend, memory);
  DieIfArmed();
  return code;
}

// Calls that change nothing are forwarded.
int Close(sqlite3_file* file) {
  const int code = Real(file)->pMethods->xClose(Real(file));
  file->pMethods = nullptr;
  return code;
}
int Read(sqlite3_file* f, void* d, int n, sqlite3_int64 o) { return Real(f)->pMethods->xRead(Real(f), d, n, o); }
int FileSize(sqlite3_file* f, sqlite3_int64* s) { return Real(f)->pMethods->xFileSize(Real(f), s); }
int Lock(sqlite3_file* f, int l) { return Real(f)->pMethods->xLock(Real(f), l); }
int Unlock(sqlite3_file* f, int l) { return Real(f)->pMethods->xUnlock(Real(f), l); }
int CheckReservedLock(sqlite3_file* f, int* r) { return Real(f)->pMethods->xCheckReservedLock(Real(f), r); }
int FileControl(sqlite3_file* f, int op, void* a) { return Real(f)->pMethods->xFileControl(Real(f), op, a); }
int SectorSize(sqlite3_file* f) { return Real(f)->pMethods->xSectorSize(Real(f)); }
int DeviceCharacteristics(sqlite3_file* f) { return Real(f)->pMethods->xDeviceCharacteristics(Real(f)); }
int ShmLock(sqlite3_file* f, int o, int n, int l) { return Real(f)->pMethods->xShmLock(Real(f), o, n, l); }
void ShmBarrier(sqlite3_file* f) { Real(f)->pMethods->xShmBarrier(Real(f)); }
int ShmUnmap(sqlite3_file* f, int d) { return Real(f)->pMethods->xShmUnmap(Real(f), d); }

const sqlite3_io_methods kMethods = {2,
                                     Close,
                                     Read,
                                     Write,
                                     Truncate,
                                     Sync,
                                     FileSize,
                                     Lock,
                                     Unlock,
                                     CheckReservedLock,
                                     FileControl,
                                     SectorSize,
                                     DeviceCharacteristics,
                                     ShmMap,
                                     ShmLock,
                                     ShmBarrier,
                                     ShmUnmap,
                                     nullptr,
                                     nullptr};

int Open(sqlite3_vfs* /*vfs*/, sqlite3_filename name, sqlite3_file* file, int flags, int* out_flags) {
  State& state = Shared();
  file->pMethods = nullptr;
  const bool creates = (flags & SQLITE_OPEN_CREATE) != 0 && name != nullptr && ::access(name, F_OK) != 0;
  if (creates) {
    const int code = Strike(false, state.fault == FaultyVfs::Fault::kFull ? SQLITE_FULL : SQLITE_IOERR);
    if (code != SQLITE_OK) {
      DieIfArmed();
      return code;
    }
  }
  const int code = state.real->xOpen(state.real, name, Real(file), flags, out_flags);
  if (Real(file)->pMethods != nullptr) file->pMethods = &kMethods;
  return code;
}

int Delete(sqlite3_vfs* /*vfs*/, const char* name, int sync_folder) {
  State& state = Shared();
  const int code = Strike(false, SQLITE_IOERR_DELETE);
  if (code == SQLITE_OK) return state.real->xDelete(state.real, name, sync_folder);
  DieIfArmed();
  return code;
}

}  // namespace

FaultyVfs::FaultyVfs() {
  State& state = Shared();
  state = {};
  state.real = sqlite3_vfs_find(nullptr);
  state.vfs = *state.real;
  state.vfs.pNext = nullptr;
  state.vfs.zName = "legopt-faulty";
  state.vfs.szOsFile = static_cast<int>(sizeof(File)) + state.real->szOsFile;
  state.vfs.xOpen = Open;
  state.vfs.xDelete = Delete;
  if (sqlite3_vfs_register(&state.vfs, 1) != SQLITE_OK) std::abort();
}

FaultyVfs::~FaultyVfs() {
  State& state = Shared();
  sqlite3_vfs_unregister(&state.vfs);
  sqlite3_vfs_register(state.real, 1);
}

void FaultyVfs::Arm(Fault fault, std::int64_t first, std::int64_t length) {
  State& state = Shared();
  state.fault = fault;
  state.first = first;
  state.length = length;
  state.calls = state.faults = 0;
}

void FaultyVfs::Disarm() { Arm(FaultyVfs::Fault::kNone, 0, 0); }
std::int64_t FaultyVfs::calls() const { return Shared().calls; }
std::int64_t FaultyVfs::faults() const { return Shared().faults; }

}  // namespace legopt::db
