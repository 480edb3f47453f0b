// SPDX-License-Identifier: MIT
#include "jobs/batch/glob.h"

#include <algorithm>
#include <cstddef>

namespace rattan {

namespace {

// Bytes of the character at `at`.
std::size_t character(std::string_view text, std::size_t at) {
  std::size_t end = at + 1;
  while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) {
    ++end;
  }
  return end - at;
}

// The end of the set that begins at `at`, behind its ']'; npos if it has none, then '[' is itself.
std::size_t set_end(std::string_view pattern, std::size_t at) {
  std::size_t i = at + 1;
  if (i < pattern.size() && (pattern[i] == '!' || pattern[i] == '^')) {
    ++i;
  }
  for (bool first = true; i < pattern.size(); ++i, first = false) {
    if (pattern[i] == ']' && !first) {
      return i + 1;
    }
  }
  return std::string_view::npos;
}

// `set` without its brackets.
bool in_set(std::string_view set, char c) {
  const bool negative = !set.empty() && (set[0] == '!' || set[0] == '^');
  if (negative) {
    set.remove_prefix(1);
  }
  bool found = false;
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (i + 2 < set.size() && set[i + 1] == '-') {
      found |= set[i] <= c && c <= set[i + 2];
      i += 2;
    } else {
      found |= set[i] == c;
    }
  }
  return found != negative;
}

// Matches one element of the pattern that isn't a star; sets how much of both it takes.
bool match_one(std::string_view pattern, std::size_t p, std::string_view path, std::size_t s,
               std::size_t& pattern_step, std::size_t& path_step) {
  pattern_step = path_step = 1;
  if (pattern[p] == '?') {
    path_step = character(path, s);
    return path[s] != '/';
  }
  if (pattern[p] == '[') {
    const std::size_t end = set_end(pattern, p);
    if (end != std::string_view::npos) {
      pattern_step = end - p;
      return path[s] != '/' && in_set(pattern.substr(p + 1, end - p - 2), path[s]);
    }
  }
  if (pattern[p] == '\\' && p + 1 < pattern.size()) {
    pattern_step = 2;
    return pattern[p + 1] == path[s];
  }
  return pattern[p] == path[s];
}

bool fits(const std::string& pattern, std::string_view path) {
  if (pattern.find('/') != std::string::npos) {
    return glob_match(pattern, path);
  }
  const std::size_t slash = path.rfind('/');
  return glob_match(pattern, slash == std::string_view::npos ? path : path.substr(slash + 1));
}

// The path itself or a folder above it.
bool fits_with_parents(const std::string& pattern, std::string_view path) {
  for (;;) {
    if (fits(pattern, path)) {
      return true;
    }
    const std::size_t slash = path.rfind('/');
    if (slash == std::string_view::npos || slash == 0) {
      return false;
    }
    path = path.substr(0, slash);
  }
}

std::vector<std::string> trimmed(std::vector<std::string> patterns) {
  for (std::string& pattern : patterns) {
    while (pattern.starts_with("./")) {
      pattern.erase(0, 2);
    }
    while (pattern.size() > 1 && pattern.ends_with('/')) {
      pattern.pop_back();
    }
  }
  std::erase_if(patterns, [](const std::string& pattern) { return pattern.empty(); });
  return patterns;
}

}  // namespace

bool glob_match(std::string_view pattern, std::string_view path) {
  constexpr std::size_t kNone = std::string_view::npos;
  std::size_t p = 0;
  std::size_t s = 0;
  // Where to go on after a mismatch: the last star of each kind takes one character more. A later
  // star never has to give back to an earlier one of the same reach.
  std::size_t star = kNone;
  std::size_t star_s = 0;
  std::size_t deep = kNone;
  std::size_t deep_s = 0;
  while (s < path.size() || p < pattern.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      if (p + 1 < pattern.size() && pattern[p + 1] == '*') {
        const bool folders =
            p + 2 < pattern.size() && pattern[p + 2] == '/' && (p == 0 || pattern[p - 1] == '/');
        p += folders ? 3 : 2;
        deep = p;
        deep_s = s;
        star = kNone;
      } else {
        star = ++p;
        star_s = s;
      }
      continue;
    }
    std::size_t pattern_step = 0;
    std::size_t path_step = 0;
    if (p < pattern.size() && s < path.size() &&
        match_one(pattern, p, path, s, pattern_step, path_step)) {
      p += pattern_step;
      s += path_step;
    } else if (star != kNone && star_s < path.size() && path[star_s] != '/') {
      p = star;
      s = ++star_s;
    } else if (deep != kNone && deep_s < path.size()) {
      // **/ ends at the beginning of a name only.
      const bool folders = deep >= 3 && pattern[deep - 1] == '/' && pattern[deep - 2] == '*';
      do {
        ++deep_s;
      } while (folders && deep_s < path.size() && path[deep_s - 1] != '/');
      if (folders && deep_s == path.size() && path.back() != '/') {
        return false;
      }
      p = deep;
      s = deep_s;
      star = kNone;
    } else {
      return false;
    }
  }
  return true;
}

PathFilter::PathFilter(const std::vector<std::string>& include,
                       const std::vector<std::string>& exclude)
    : include_(trimmed(include)), exclude_(trimmed(exclude)) {}

bool PathFilter::takes(std::string_view path) const {
  const auto any = [&](const std::vector<std::string>& patterns) {
    return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
      return fits_with_parents(pattern, path);
    });
  };
  return (include_.empty() || any(include_)) && !any(exclude_);
}

bool PathFilter::skips_folder(std::string_view path) const {
  return std::any_of(exclude_.begin(), exclude_.end(),
                     [&](const std::string& pattern) { return fits_with_parents(pattern, path); });
}

}  // namespace rattan
