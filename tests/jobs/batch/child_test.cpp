// SPDX-License-Identifier: MIT
#include <chrono>
#include <csignal>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "jobs/batch/child_log.h"
#include "jobs/batch/child_process.h"
#include "tests/jobs/batch/batch_fixture.h"

namespace rattan {
namespace {

using namespace std::chrono_literals;

class ChildTest : public BatchFixture {};

std::vector<std::string> run(const std::string& script, ChildProcess** left = nullptr) {
  auto child =
      std::make_unique<ChildProcess>(std::vector<std::string>{"/bin/sh", "-c", script}, false);
  std::vector<std::string> lines;
  const auto keep = [&](std::string_view line) { lines.emplace_back(line); };
  for (int i = 0; i < 1000 && !child->reap(keep); ++i) {
    child->read_lines(keep);
    std::this_thread::sleep_for(5ms);
  }
  if (left != nullptr) {
    *left = child.release();
  }
  return lines;
}

TEST_F(ChildTest, HandsOutEveryLineAlsoTheLastWithoutItsEnd) {
  ChildProcess* child = nullptr;
  const auto lines =
      run("echo thrown away; echo one >&2; echo >&2; printf 'two' >&2; exit 3", &child);
  EXPECT_EQ(lines, (std::vector<std::string>{"one", "", "two"}));
  EXPECT_FALSE(child->was_signalled());
  EXPECT_EQ(child->exit_code(), 3);
  EXPECT_GT(child->peak_rss_bytes(), 100000U);
  delete child;
}

TEST_F(ChildTest, HandsOutMuchTextWithoutLoss) {
  const auto lines = run("i=0; while [ $i -lt 20000 ]; do echo line $i >&2; i=$((i+1)); done");
  ASSERT_EQ(lines.size(), 20000U);
  EXPECT_EQ(lines[19999], "line 19999");
}

TEST_F(ChildTest, TellsTheSignalThatEndedIt) {
  ChildProcess* child = nullptr;
  run("kill -SEGV $$", &child);
  EXPECT_TRUE(child->was_signalled());
  EXPECT_EQ(child->signal(), SIGSEGV);
  delete child;
}

TEST_F(ChildTest, CountsProcessorTime) {
  ChildProcess* child = nullptr;
  run("i=0; while [ $i -lt 100000 ]; do i=$((i+1)); done", &child);
  EXPECT_GT(child->cpu_seconds(), 0.005);
  delete child;
}

TEST_F(ChildTest, StartsWithDefaultSignalsInAGroupOfItsOwn) {
  sigset_t mask;
  sigset_t before;
  sigfillset(&mask);
  pthread_sigmask(SIG_SETMASK, &mask, &before);
  const auto lines =
      run("grep SigBlk /proc/self/status >&2; grep SigIgn /proc/self/status >&2;"
          "[ $(ps -o pgid= -p $$) = $$ ] && echo own >&2");
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  ASSERT_EQ(lines.size(), 3U);
  const auto bits = [](const std::string& line) {
    return std::stoull(line.substr(line.find_last_of(" \t") + 1), nullptr, 16);
  };
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1, SIGCHLD}) {
    EXPECT_EQ(bits(lines[0]) >> (signal - 1) & 1U, 0U) << signal;
  }
  EXPECT_EQ(bits(lines[1]) >> (SIGPIPE - 1) & 1U, 1U);
  EXPECT_EQ(lines[2], "own");
}

TEST_F(ChildTest, SaysWhatCannotBeStarted) {
  EXPECT_THROW(ChildProcess({path("nothing"), "x"}, false), ResourceError);
}

TEST_F(ChildTest, DiesWithItsParentHoweverThatDies) {
  const std::string seen = path("seen");
  const pid_t parent = ::fork();
  if (parent == 0) {
    const ChildProcess child({"/bin/sh", "-c",
                              "trap 'echo saved > " + seen + "; exit 75' TERM; echo up > " +
                                  path("up") + "; while :; do sleep 0.02; done"},
                             false);
    ::pause();
    ::_exit(0);
  }
  for (int i = 0; i < 500 && read(path("up")).empty(); ++i) {
    std::this_thread::sleep_for(10ms);
  }
  ::kill(parent, SIGKILL);
  ::waitpid(parent, nullptr, 0);
  for (int i = 0; i < 500 && read(seen).empty(); ++i) {
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(read(seen), "saved\n");
}

TEST_F(ChildTest, IsKilledWhenForgotten) {
  pid_t pid = 0;
  {
    const ChildProcess child({"/bin/sleep", "100"}, false);
    pid = child.pid();
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_NE(::kill(pid, 0), 0);
}

TEST(ShellCommand, QuotesWhatAShellWouldTakeApart) {
  EXPECT_EQ(shell_command({"rattan", "remesh", "/a b/it's.ply", "--faces", "50k,10k", ""}),
            "rattan remesh '/a b/it'\\''s.ply' --faces 50k,10k ''");
}

TEST(ChildLog, TellsEventsFromText) {
  ChildLog log;
  nlohmann::json event;
  EXPECT_TRUE(log.take(R"({"time":"x","event":"warning","text":"beware"})", event));
  EXPECT_EQ(event.at("text"), "beware");
  EXPECT_TRUE(log.take(R"({"event":"error","text":"file: line 3: bad","exit":3})", event));
  EXPECT_TRUE(log.take(R"({"event":"end","exit":3,"peak_rss_bytes":123456})", event));
  EXPECT_FALSE(log.take("terminate called", event));
  EXPECT_FALSE(log.take("{ this is no event", event));
  EXPECT_FALSE(log.take("{}", event));
  EXPECT_EQ(log.warnings(), 1U);
  EXPECT_EQ(log.peak_rss_bytes(), 123456U);
  EXPECT_EQ(log.sentence(), "file: line 3: bad");
  EXPECT_EQ(
      log.text(),
      "warning: beware\nerror: file: line 3: bad\nterminate called\n{ this is no event\n{}\n");
}

TEST(ChildLog, KeepsBothEndsOfALongStory) {
  ChildLog log;
  nlohmann::json event;
  for (int i = 0; i < 100000; ++i) {
    log.take("line " + std::to_string(i), event);
  }
  const std::string text = log.text();
  EXPECT_LT(text.size(), 120000U);
  EXPECT_NE(text.find("line 0\n"), std::string::npos);
  EXPECT_NE(text.find("line 99999\n"), std::string::npos);
  EXPECT_NE(text.find("bytes left out"), std::string::npos);
  EXPECT_EQ(log.sentence(), "line 99999");
}

}  // namespace
}  // namespace rattan
