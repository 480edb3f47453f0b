// SPDX-License-Identifier: MIT
// Preloaded into a program under test: fails, shortens or kills at the N-th of its calls on files
// below a folder, and logs those calls. By the environment:
//   FAULT_UNDER   the folder, an absolute path; calls on other files pass
//   FAULT_ON      kinds that count: any of "write truncate sync rename open unlink read"
//   FAULT_AT      which of them, from 1; 0 or absent: none
//   FAULT_DO      "kill", "short", "interrupt", or a number: errno
//   FAULT_STICKY  not empty: every one from then on
//   FAULT_LOG     file for the log, a line a call (see calls.py)
//   FAULT_GRAVES  folder on the same file system for links to the files that calls remove
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum Action { kPass, kFail, kShort };

static const char *under, *on, *graves;
static size_t under_length;
static long at;
static int do_errno, do_kill, do_short, sticky, log_fd = -1;
static atomic_long calls, grave_count;
static pthread_once_t once = PTHREAD_ONCE_INIT;

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static void start(void) {
  under = getenv("FAULT_UNDER");
  under_length = under ? strlen(under) : 0;
  on = getenv("FAULT_ON") ? getenv("FAULT_ON") : "";
  graves = getenv("FAULT_GRAVES");
  at = getenv("FAULT_AT") ? atol(getenv("FAULT_AT")) : 0;
  const char* what = getenv("FAULT_DO") ? getenv("FAULT_DO") : "0";
  do_kill = strcmp(what, "kill") == 0;
  do_short = strcmp(what, "short") == 0;
  do_errno = strcmp(what, "interrupt") == 0 ? EINTR : atoi(what);
  sticky = getenv("FAULT_STICKY") && *getenv("FAULT_STICKY");
  if (getenv("FAULT_LOG")) {
    log_fd = (int)syscall(SYS_openat, AT_FDCWD, getenv("FAULT_LOG"),
                          O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  }
}

static int watched(const char* path) {
  pthread_once(&once, start);
  return under && strncmp(path, under, under_length) == 0 &&
         (path[under_length] == '/' || path[under_length] == '\0');
}

/// Absolute path of (directory, name), as far as the watched folder is concerned.
static void full_path(int directory, const char* name, char* path) {
  if (name[0] == '/') {
    snprintf(path, PATH_MAX, "%s", name);
    return;
  }
  char base[PATH_MAX / 2] = "";
  if (directory == AT_FDCWD) {
    if (!getcwd(base, sizeof base)) base[0] = '\0';
  } else {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", directory);
    const ssize_t n = readlink(link, base, sizeof base - 1);
    base[n > 0 ? n : 0] = '\0';
  }
  snprintf(path, PATH_MAX, "%s/%s", base, name);
}

static int watched_fd(int fd, char* path) {
  pthread_once(&once, start);
  if (!under) return 0;
  char link[64];
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t n = readlink(link, path, PATH_MAX - 1);
  if (n <= 0) return 0;
  path[n] = '\0';
  return watched(path);
}

static void note(const char* format, ...) {
  if (log_fd < 0) return;
  char line[3 * PATH_MAX];
  va_list args;
  va_start(args, format);
  const int n = vsnprintf(line, sizeof line, format, args);
  va_end(args);
  const int kept = errno;
  syscall(SYS_write, log_fd, line, n);
  errno = kept;
}

static unsigned long inode_of(int fd) {
  struct stat s;
  return fstat(fd, &s) == 0 ? (unsigned long)s.st_ino : 0;
}

static enum Action act(const char* kind) {
  if (at == 0 || !strstr(on, kind)) return kPass;
  const long n = 1 + atomic_fetch_add(&calls, 1);
  if (sticky ? n < at : n != at) return kPass;
  if (do_kill) {
    kill(getpid(), SIGKILL);
    pause();
  }
  if (do_short) return kShort;
  errno = do_errno;
  return kFail;
}

static void note_write(int fd, long offset, size_t length, const char* path) {
  if (log_fd < 0) return;
  if (offset < 0) {
    struct stat s;
    offset = fcntl(fd, F_GETFL) & O_APPEND ? (fstat(fd, &s) == 0 ? (long)s.st_size : 0)
                                           : (long)lseek(fd, 0, SEEK_CUR);
  }
  note("W %lu %ld %zu %s\n", inode_of(fd), offset, length, path);
}

// ---- data ----

ssize_t write(int fd, const void* data, size_t length) {
  char path[PATH_MAX];
  if (!watched_fd(fd, path)) return REAL(write)(fd, data, length);
  const enum Action action = act("write");
  if (action == kFail) return -1;
  if (action == kShort && length > 1) length /= 2;
  note_write(fd, -1, length, path);
  return REAL(write)(fd, data, length);
}

static ssize_t any_pwrite(int fd, const void* data, size_t length, off64_t offset) {
  char path[PATH_MAX];
  if (!watched_fd(fd, path)) return REAL(pwrite64)(fd, data, length, offset);
  const enum Action action = act("write");
  if (action == kFail) return -1;
  if (action == kShort && length > 1) length /= 2;
  note_write(fd, (long)offset, length, path);
  return REAL(pwrite64)(fd, data, length, offset);
}
ssize_t pwrite(int fd, const void* data, size_t length, off_t offset) {
  return any_pwrite(fd, data, length, offset);
}
ssize_t pwrite64(int fd, const void* data, size_t length, off64_t offset) {
  return any_pwrite(fd, data, length, offset);
}

ssize_t writev(int fd, const struct iovec* parts, int count) {
  char path[PATH_MAX];
  if (!watched_fd(fd, path)) return REAL(writev)(fd, parts, count);
  const enum Action action = act("write");
  if (action == kFail) return -1;
  if (action == kShort && count > 1) count = 1;
  size_t length = 0;
  for (int k = 0; k < count; ++k) length += parts[k].iov_len;
  note_write(fd, -1, length, path);
  return REAL(writev)(fd, parts, count);
}

static ssize_t any_pread(int fd, void* data, size_t length, off64_t offset) {
  char path[PATH_MAX];
  if (watched_fd(fd, path)) {
    const enum Action action = act("read");
    if (action == kFail) return -1;
    if (action == kShort && length > 1) length /= 2;
  }
  return REAL(pread64)(fd, data, length, offset);
}
ssize_t pread(int fd, void* data, size_t length, off_t offset) {
  return any_pread(fd, data, length, offset);
}
ssize_t pread64(int fd, void* data, size_t length, off64_t offset) {
  return any_pread(fd, data, length, offset);
}
ssize_t read(int fd, void* data, size_t length) {
  char path[PATH_MAX];
  if (watched_fd(fd, path)) {
    const enum Action action = act("read");
    if (action == kFail) return -1;
    if (action == kShort && length > 1) length /= 2;
  }
  return REAL(read)(fd, data, length);
}

static int any_truncate(int fd, off64_t length) {
  char path[PATH_MAX];
  if (watched_fd(fd, path)) {
    if (act("truncate") == kFail) return -1;
    note("T %lu %ld 0 %s\n", inode_of(fd), (long)length, path);
  }
  return REAL(ftruncate64)(fd, length);
}
int ftruncate(int fd, off_t length) {
  return any_truncate(fd, length);
}
int ftruncate64(int fd, off64_t length) {
  return any_truncate(fd, length);
}

static int any_allocate(int fd, off64_t offset, off64_t length) {
  char path[PATH_MAX];
  if (watched_fd(fd, path)) {
    if (act("write") == kFail) return errno;
    note("W %lu %ld 0 %s\n", inode_of(fd), (long)offset, path);
  }
  return REAL(posix_fallocate64)(fd, offset, length);
}
int posix_fallocate(int fd, off_t offset, off_t length) {
  return any_allocate(fd, offset, length);
}
int posix_fallocate64(int fd, off64_t offset, off64_t length) {
  return any_allocate(fd, offset, length);
}

#define SYNC(name)                                \
  int name(int fd) {                              \
    char path[PATH_MAX];                          \
    const int mine = watched_fd(fd, path);        \
    if (mine && act("sync") == kFail) return -1;  \
    const int result = REAL(name)(fd);            \
    if (mine && result == 0) {                    \
      note("S %lu 0 0 %s\n", inode_of(fd), path); \
    }                                             \
    return result;                                \
  }
SYNC(fsync)
SYNC(fdatasync)

// ---- names ----

/// Links the file that is about to go; returns the number of its grave, 0 without one.
static long bury(const char* path) {
  if (!graves) return 0;
  const long number = 1 + atomic_fetch_add(&grave_count, 1);
  char grave[PATH_MAX + 32];
  snprintf(grave, sizeof grave, "%s/%ld", graves, number);
  return syscall(SYS_linkat, AT_FDCWD, path, AT_FDCWD, grave, 0) == 0 ? number : 0;
}

static int rename_watched(int from_dir, const char* from, int to_dir, const char* to) {
  char old_path[PATH_MAX], new_path[PATH_MAX];
  full_path(from_dir, from, old_path);
  full_path(to_dir, to, new_path);
  if (!watched(new_path) && !watched(old_path)) return 0;
  if (act("rename") == kFail) return -1;
  note("R 0 %ld 0 %s\t%s\n", bury(new_path), old_path, new_path);
  return 0;
}
int rename(const char* from, const char* to) {
  return rename_watched(AT_FDCWD, from, AT_FDCWD, to) < 0 ? -1 : REAL(rename)(from, to);
}
int renameat(int from_dir, const char* from, int to_dir, const char* to) {
  return rename_watched(from_dir, from, to_dir, to) < 0
             ? -1
             : REAL(renameat)(from_dir, from, to_dir, to);
}
int renameat2(int from_dir, const char* from, int to_dir, const char* to, unsigned flags) {
  return rename_watched(from_dir, from, to_dir, to) < 0
             ? -1
             : REAL(renameat2)(from_dir, from, to_dir, to, flags);
}

static int unlink_watched(int directory, const char* name) {
  char path[PATH_MAX];
  struct stat s;
  full_path(directory, name, path);
  if (!watched(path) || lstat(path, &s) != 0) return 0;
  if (act("unlink") == kFail) return -1;
  if (S_ISDIR(s.st_mode)) {
    note("D 0 0 0 %s\n", path);
  } else {
    note("U 0 %ld 0 %s\n", bury(path), path);
  }
  return 0;
}
int unlink(const char* path) {
  return unlink_watched(AT_FDCWD, path) < 0 ? -1 : REAL(unlink)(path);
}
int remove(const char* path) {
  return unlink_watched(AT_FDCWD, path) < 0 ? -1 : REAL(remove)(path);
}
int rmdir(const char* path) {
  return unlink_watched(AT_FDCWD, path) < 0 ? -1 : REAL(rmdir)(path);
}
int unlinkat(int directory, const char* name, int flags) {
  return unlink_watched(directory, name) < 0 ? -1 : REAL(unlinkat)(directory, name, flags);
}

int mkdir(const char* name, mode_t mode) {
  const int result = REAL(mkdir)(name, mode);
  char path[PATH_MAX];
  full_path(AT_FDCWD, name, path);
  if (result == 0 && watched(path)) note("M 0 0 0 %s\n", path);
  return result;
}

/// Whether a call to open may make a file below the folder; path is then set.
static int makes(int directory, const char* name, int flags, char* path) {
  if (!(flags & (O_CREAT | O_TRUNC))) return 0;
  full_path(directory, name, path);
  return watched(path);
}
static int after_open(int fd, int existed, int flags, const char* path) {
  if (fd >= 0 && !existed) note("C %lu 0 0 %s\n", inode_of(fd), path);
  if (fd >= 0 && existed && flags & O_TRUNC) note("T %lu 0 0 %s\n", inode_of(fd), path);
  return fd;
}
static int any_open(int directory, const char* name, int flags, mode_t mode) {
  char path[PATH_MAX];
  if (!makes(directory, name, flags, path)) {
    return REAL(openat64)(directory, name, flags | O_LARGEFILE, mode);
  }
  if (act("open") == kFail) return -1;
  const int existed = access(path, F_OK) == 0;
  return after_open(REAL(openat64)(directory, name, flags | O_LARGEFILE, mode), existed, flags,
                    path);
}
#define MODE(flags, mode, last)                           \
  mode_t mode = 0;                                        \
  if ((flags) & (O_CREAT | (O_TMPFILE & ~O_DIRECTORY))) { \
    va_list args;                                         \
    va_start(args, last);                                 \
    mode = va_arg(args, mode_t);                          \
    va_end(args);                                         \
  }
int open(const char* name, int flags, ...) {
  MODE(flags, mode, flags)
  return any_open(AT_FDCWD, name, flags, mode);
}
int open64(const char* name, int flags, ...) {
  MODE(flags, mode, flags)
  return any_open(AT_FDCWD, name, flags, mode);
}
int openat(int directory, const char* name, int flags, ...) {
  MODE(flags, mode, flags)
  return any_open(directory, name, flags, mode);
}
int openat64(int directory, const char* name, int flags, ...) {
  MODE(flags, mode, flags)
  return any_open(directory, name, flags, mode);
}
int creat(const char* name, mode_t mode) {
  return any_open(AT_FDCWD, name, O_CREAT | O_WRONLY | O_TRUNC, mode);
}

#define OPEN_STREAM(name)                                                           \
  FILE* name(const char* file_name, const char* how) {                              \
    char path[PATH_MAX];                                                            \
    if (how[0] == 'r' || !makes(AT_FDCWD, file_name, O_CREAT, path)) {              \
      return REAL(name)(file_name, how);                                            \
    }                                                                               \
    if (act("open") == kFail) return NULL;                                          \
    const int existed = access(path, F_OK) == 0;                                    \
    FILE* file = REAL(name)(file_name, how);                                        \
    if (file) after_open(fileno(file), existed, how[0] == 'w' ? O_TRUNC : 0, path); \
    return file;                                                                    \
  }
OPEN_STREAM(fopen)
OPEN_STREAM(fopen64)
