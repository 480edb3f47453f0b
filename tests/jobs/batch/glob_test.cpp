// SPDX-License-Identifier: MIT
#include "jobs/batch/glob.h"

#include <random>
#include <string>

#include <gtest/gtest.h>

namespace rattan {
namespace {

TEST(Glob, MatchesNames) {
  EXPECT_TRUE(glob_match("*.ply", "a.ply"));
  EXPECT_TRUE(glob_match("*.ply", ".ply"));
  EXPECT_FALSE(glob_match("*.ply", "a.ply.gz"));
  EXPECT_FALSE(glob_match("*.ply", "a/b.ply"));
  EXPECT_TRUE(glob_match("a?c", "abc"));
  EXPECT_FALSE(glob_match("a?c", "ac"));
  EXPECT_FALSE(glob_match("a?c", "a/c"));
  EXPECT_TRUE(glob_match("?.ply", "\xc3\xa9.ply"));  // one character of two bytes
  EXPECT_TRUE(glob_match("", ""));
  EXPECT_FALSE(glob_match("", "a"));
  EXPECT_TRUE(glob_match("*", ""));
  EXPECT_TRUE(glob_match("*a*b*", "xxaxxbxx"));
  EXPECT_FALSE(glob_match("*a*b*", "xxbxxaxx"));
  EXPECT_TRUE(glob_match("scan_*_final*.obj", "scan_a_final_final2.obj"));
}

TEST(Glob, MatchesSets) {
  EXPECT_TRUE(glob_match("[a-c]x", "bx"));
  EXPECT_FALSE(glob_match("[a-c]x", "dx"));
  EXPECT_TRUE(glob_match("[!a-c]x", "dx"));
  EXPECT_FALSE(glob_match("[!a-c]x", "ax"));
  EXPECT_TRUE(glob_match("[]]", "]"));
  EXPECT_TRUE(glob_match("[a-]", "-"));
  EXPECT_FALSE(glob_match("[!a]", "/"));
  EXPECT_TRUE(glob_match("a[b", "a[b"));  // no set without its end
  EXPECT_TRUE(glob_match("\\*", "*"));
  EXPECT_FALSE(glob_match("\\*", "a"));
  EXPECT_TRUE(glob_match("a\\[1\\]", "a[1]"));
}

TEST(Glob, MatchesFolders) {
  EXPECT_TRUE(glob_match("**/x.ply", "x.ply"));
  EXPECT_TRUE(glob_match("**/x.ply", "a/b/x.ply"));
  EXPECT_FALSE(glob_match("**/x.ply", "a/yx.ply"));
  EXPECT_TRUE(glob_match("a/**", "a/b/c"));
  EXPECT_FALSE(glob_match("a/**", "b/a/c"));
  EXPECT_TRUE(glob_match("a/**/z", "a/z"));
  EXPECT_TRUE(glob_match("a/**/z", "a/b/c/z"));
  EXPECT_FALSE(glob_match("a/**/z", "az"));
  EXPECT_FALSE(glob_match("a/**/z", "a/b/cz"));
  EXPECT_TRUE(glob_match("**", "a/b"));
  EXPECT_TRUE(glob_match("a**z", "a/b/z"));
  EXPECT_TRUE(glob_match("*/b/*", "a/b/c"));
  EXPECT_FALSE(glob_match("*/b/*", "a/x/b/c"));
  EXPECT_TRUE(glob_match("**/a/**/b", "x/a/y/a/b"));
}

// The plain definition, exponential.
bool slow_match(const char* p, const char* s, bool name_start) {
  if (*p == '\0') {
    return *s == '\0';
  }
  if (p[0] == '*' && p[1] == '*' && p[2] == '/' && name_start) {
    if (slow_match(p + 3, s, true)) {
      return true;
    }
    for (; *s != '\0'; ++s) {
      if (*s == '/' && slow_match(p + 3, s + 1, true)) {
        return true;
      }
    }
    return false;
  }
  if (p[0] == '*') {
    const bool deep = p[1] == '*';
    const char* rest = p + (deep ? 2 : 1);
    for (;; ++s) {
      if (slow_match(rest, s, false)) {
        return true;
      }
      if (*s == '\0' || (!deep && *s == '/')) {
        return false;
      }
    }
  }
  if (*s == '\0' || (*p == '?' ? *s == '/' : *p != *s)) {
    return false;
  }
  return slow_match(p + 1, s + 1, *p == '/');
}

TEST(Glob, AgreesWithItsDefinition) {
  std::mt19937 random(7);
  int matches = 0;
  for (int k = 0; k < 300000; ++k) {
    std::string pattern;
    std::string path;
    for (std::size_t n = random() % 7; n > 0; --n) {
      static const char* kParts[] = {"a", "b", "/", "*", "?", "**/", "**"};
      // A star right behind another would join with it.
      const char* part = kParts[random() % 7];
      if (!pattern.empty() && pattern.back() == '*' && part[0] == '*') {
        continue;
      }
      pattern += part;
    }
    for (std::size_t n = random() % 8; n > 0; --n) {
      path += "ab/"[random() % 3];
    }
    const bool expected = slow_match(pattern.c_str(), path.c_str(), true);
    matches += expected ? 1 : 0;
    ASSERT_EQ(glob_match(pattern, path), expected) << pattern << " on " << path;
  }
  EXPECT_GT(matches, 10000);
}

TEST(PathFilter, TakesByNameOrPath) {
  const PathFilter all;
  EXPECT_TRUE(all.takes("a/b.ply"));
  EXPECT_FALSE(all.skips_folder("a"));

  const PathFilter some({"*.ply", "raw/*.obj"}, {"*_draft*", "old", "b/x"});
  EXPECT_TRUE(some.takes("c/d/e.ply"));
  EXPECT_TRUE(some.takes("raw/e.obj"));
  EXPECT_FALSE(some.takes("c/raw/e.obj"));
  EXPECT_FALSE(some.takes("e.obj"));
  EXPECT_FALSE(some.takes("c/e_draft2.ply"));
  EXPECT_FALSE(some.takes("c/old/e.ply"));
  EXPECT_FALSE(some.takes("b/x/y/e.ply"));
  EXPECT_TRUE(some.takes("a/b/x/e.ply"));
  EXPECT_TRUE(some.skips_folder("c/old"));
  EXPECT_TRUE(some.skips_folder("b/x"));
  EXPECT_FALSE(some.skips_folder("b"));

  const PathFilter folder({"statues/"}, {});
  EXPECT_TRUE(folder.takes("rome/statues/a.ply"));
  EXPECT_FALSE(folder.takes("rome/busts/a.ply"));
}

}  // namespace
}  // namespace rattan
