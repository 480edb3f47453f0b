// SPDX-License-Identifier: MIT
#include "io/store/work_lock.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/errors.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

class WorkLockTest : public ::testing::Test {
 protected:
  WorkLockTest() {
    std::string name = (fs::temp_directory_path() / "rattan_lock_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      throw std::runtime_error("no temporary directory");
    }
    base_ = name;
    work_ = base_ / "work";
  }
  ~WorkLockTest() override { fs::remove_all(base_); }

  void leave_lock_of(const std::string& host, int seconds_old) {
    fs::create_directories(work_);
    std::ofstream(work_ / "lock.1") << "host=" << host << "\nboot=other\npid=123\n";
    const timespec times[2] = {{::time(nullptr) - seconds_old, 0},
                               {::time(nullptr) - seconds_old, 0}};
    ASSERT_EQ(::utimensat(AT_FDCWD, (work_ / "lock.1").c_str(), times, 0), 0);
  }
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(work_)) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  }

  fs::path base_;
  fs::path work_;
};

TEST_F(WorkLockTest, OneAtATimeAndNothingStays) {
  {
    const WorkLock lock(work_);
    EXPECT_TRUE(lock.held());
    try {
      const WorkLock second(work_);
      ADD_FAILURE() << "two have it";
    } catch (const ResourceError& e) {
      const std::string text = e.what();
      EXPECT_NE(text.find(work_.string()), std::string::npos);
      EXPECT_NE(text.find("process " + std::to_string(::getpid())), std::string::npos) << text;
    }
    EXPECT_TRUE(lock.held());
    EXPECT_EQ(files(), std::vector<std::string>{"lock.1"});
  }
  EXPECT_FALSE(fs::exists(work_));
  fs::create_directory(work_);  // as a power cut may leave it
  { const WorkLock again(work_); }
  EXPECT_FALSE(fs::exists(work_));
  fs::create_directory(work_);
  std::ofstream(work_ / "mine") << "1";
  { const WorkLock again(work_); }
  EXPECT_EQ(files(), std::vector<std::string>{"mine"});
}

TEST_F(WorkLockTest, TheLockOfAKilledProcessIsTakenOver) {
  const pid_t child = ::fork();
  if (child == 0) {
    const WorkLock lock(work_);
    std::ofstream(base_ / "ready") << "1";
    ::pause();
  }
  while (!fs::exists(base_ / "ready")) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  EXPECT_THROW(WorkLock{work_}, ResourceError);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  const WorkLock lock(work_);
  EXPECT_TRUE(lock.held());
  EXPECT_EQ(files(), std::vector<std::string>{"lock.2"});
}

TEST_F(WorkLockTest, OnAnotherMachineTheTimeOfTheLastTouchDecides) {
  leave_lock_of("elsewhere", 2);
  try {
    const WorkLock lock(work_);
    ADD_FAILURE() << "the holder lives";
  } catch (const ResourceError& e) {
    EXPECT_NE(std::string(e.what()).find("process 123 on elsewhere"), std::string::npos);
  }
  EXPECT_EQ(files(), std::vector<std::string>{"lock.1"});
  leave_lock_of("elsewhere", 3600);
  const WorkLock lock(work_);
  EXPECT_EQ(files(), std::vector<std::string>{"lock.2"});
}

TEST_F(WorkLockTest, AHolderTouchesAndNoticesThatItWasReplaced) {
  const WorkLock lock(work_, {.touch = milliseconds(20), .dead_after = milliseconds(30000)});
  const fs::path file = work_ / "lock.1";
  const timespec old[2] = {{1000, 0}, {1000, 0}};
  ASSERT_EQ(::utimensat(AT_FDCWD, file.c_str(), old, 0), 0);
  struct stat now {};
  for (int k = 0; k < 500 && now.st_mtim.tv_sec <= 1000; ++k) {
    std::this_thread::sleep_for(milliseconds(10));
    ::stat(file.c_str(), &now);
  }
  EXPECT_GT(now.st_mtim.tv_sec, 1000);
  std::ofstream(work_ / "lock.2") << "host=elsewhere\n";
  EXPECT_FALSE(lock.held());
}

// Many processes at once, where a dead one's lock lies: never two at a time, and somebody gets it.
TEST_F(WorkLockTest, OfManyTakersOneWins) {
  for (int round = 0; round < 10; ++round) {
    leave_lock_of("elsewhere", 3600);
    std::vector<pid_t> children;
    for (int k = 0; k < 6; ++k) {
      const pid_t child = ::fork();
      if (child == 0) {
        int code = 3;
        try {
          const WorkLock lock(work_);
          const fs::path mark = base_ / "inside";
          const int fd = ::open(mark.c_str(), O_CREAT | O_EXCL | O_WRONLY, 0600);
          std::this_thread::sleep_for(milliseconds(150));
          code = fd >= 0 ? 0 : 1;  // 1: somebody else is inside
          ::unlink(mark.c_str());
        } catch (const ResourceError&) {
          code = 2;
        }
        ::_exit(code);
      }
      children.push_back(child);
    }
    int winners = 0;
    for (const pid_t child : children) {
      int status = 0;
      ::waitpid(child, &status, 0);
      ASSERT_TRUE(WIFEXITED(status));
      EXPECT_NE(WEXITSTATUS(status), 1) << "two at a time";
      EXPECT_NE(WEXITSTATUS(status), 3);
      winners += WEXITSTATUS(status) == 0 ? 1 : 0;
    }
    EXPECT_GE(winners, 1);
    fs::remove_all(work_);
  }
}

}  // namespace
}  // namespace rattan
