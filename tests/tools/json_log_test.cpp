// SPDX-License-Identifier: MIT
#include "tools/rattan/json_log.h"

#include <array>
#include <new>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "tools/rattan/exit_code.h"

namespace rattan {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

/// What `write` leaves in a pipe, a line an element.
template <class Write>
std::vector<json> lines_of(const Write& write) {
  std::array<int, 2> ends{};
  EXPECT_EQ(::pipe(ends.data()), 0);
  std::string text;
  std::jthread reader([&] {
    std::array<char, 4096> buffer{};
    for (ssize_t n = 1; n > 0;) {
      n = ::read(ends[0], buffer.data(), buffer.size());
      text.append(buffer.data(), n > 0 ? static_cast<std::size_t>(n) : 0);
    }
  });
  write(ends[1]);
  ::close(ends[1]);
  reader.join();
  ::close(ends[0]);
  EXPECT_TRUE(text.empty() || text.back() == '\n');
  std::vector<json> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    lines.push_back(json::parse(text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return lines;
}

template <class Error>
std::vector<json> lines_of_failure(const Error& failure, int expected) {
  return lines_of([&](int fd) {
    JsonLog log(fd);
    log.set_scan("a.ply");
    const int exit =
        run_guarded([&]() -> int { throw failure; },
                    [&](const std::string& sentence, int code) { log.error(sentence, code); });
    EXPECT_EQ(exit, expected);
  });
}

void expect_failure(const std::vector<json>& lines, int exit, const std::string& text) {
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0]["event"], "error");
  EXPECT_EQ(lines[0]["exit"], exit);
  EXPECT_EQ(lines[0]["scan"], "a.ply");
  EXPECT_THAT(lines[0]["text"].get<std::string>(), HasSubstr(text));
  EXPECT_EQ(lines[1]["event"], "end");
  EXPECT_EQ(lines[1]["exit"], exit);
}

TEST(JsonLog, EveryErrorIsToldWithItsCode) {
  expect_failure(lines_of_failure(InternalError("a promise"), 1), 1, "a defect in Rattan");
  expect_failure(lines_of_failure(std::runtime_error("what"), 1), 1, "what");
  expect_failure(lines_of_failure(UsageError("--x"), 2), 2, "--x");
  expect_failure(lines_of_failure(InputError("a.ply", "line 3", "bad", "Mend it"), 3), 3, "line 3");
  expect_failure(lines_of_failure(ResourceError("full"), 4), 4, "full");
  expect_failure(lines_of_failure(std::bad_alloc(), 4), 4, "memory");
  expect_failure(lines_of_failure(Cancelled("stopped"), 75), 75, "stopped");
}

TEST(JsonLog, LinesOfManyThreadsStayWhole) {
  constexpr int kThreads = 8;
  constexpr int kLines = 50;
  // Longer than a pipe takes at once.
  const std::string sentence(10000, 'x');
  const std::vector<json> lines = lines_of([&](int fd) {
    JsonLog log(fd);
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t) {
      threads.emplace_back([&] {
        for (int k = 0; k < kLines; ++k) {
          log.warning(sentence);
        }
      });
    }
  });
  ASSERT_EQ(lines.size(), static_cast<std::size_t>(kThreads * kLines));
  for (const json& line : lines) {
    EXPECT_EQ(line["text"], sentence);
  }
}

TEST(JsonLog, NamesThatAreNoTextAreReplaced) {
  const std::vector<json> lines = lines_of([](int fd) {
    JsonLog log(fd);
    log.set_scan("\xff\n\".ply");
    log.warning("\xc3");
  });
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0]["scan"], "\xef\xbf\xbd\n\".ply");
  EXPECT_EQ(lines[0]["text"], "\xef\xbf\xbd");
}

TEST(JsonLog, IsFoundOnTheCommandLineBeforeParsing) {
  const auto wanted = [](std::vector<const char*> words) {
    words.insert(words.begin(), "rattan");
    return json_log_wanted(static_cast<int>(words.size()), words.data());
  };
  EXPECT_TRUE(wanted({"remesh", "a.ply", "--log-format", "json"}));
  EXPECT_TRUE(wanted({"--log-format=json"}));
  EXPECT_TRUE(wanted({"--log-format=text", "--log-format", "json"}));
  EXPECT_FALSE(wanted({}));
  EXPECT_FALSE(wanted({"--log-format"}));
  EXPECT_FALSE(wanted({"--log-format", "text"}));
  EXPECT_FALSE(wanted({"--log-formats=json"}));
  EXPECT_FALSE(wanted({"--", "--log-format", "json"}));
}

}  // namespace
}  // namespace rattan
