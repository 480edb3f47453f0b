// SPDX-License-Identifier: MIT
#include "jobs/batch/collect.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <dirent.h>
#include <fcntl.h>
#include <memory>
#include <set>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include "engine/core/errors.h"

namespace rattan {

namespace {

bool same_ignoring_case(std::string_view a, std::string_view b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](char x, char y) {
           return (x >= 'A' && x <= 'Z' ? x - 'A' + 'a' : x) == y;
         });
}

template <std::size_t N>
bool one_of(std::string_view text, const std::array<std::string_view, N>& words) {
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return same_ignoring_case(text, word); });
}

// Behind the last dot; empty for a name that only begins with one.
std::string_view last_extension(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  return dot == std::string_view::npos || dot == 0 ? std::string_view() : name.substr(dot + 1);
}

constexpr std::array<std::string_view, 2> kPacked = {"gz", "zst"};
constexpr std::array<std::string_view, 5> kKnown = {"ply", "obj", "stl", "off", "drc"};

using Identity = std::pair<dev_t, ino_t>;

class Walk {
 public:
  Walk(const std::string& root, const WalkOptions& options,
       const std::function<void(FoundScan&&)>& found)
      : root_(root), options_(options), found_(found) {
    struct stat status {};
    if (!options.skip.empty() && ::stat(options.skip.c_str(), &status) == 0) {
      skip_ = {status.st_dev, status.st_ino};
    }
  }

  void run() {
    folder("", true);
    // Links last, each when all that is reached without it has been: so that a path through a link
    // is only taken where there is no other.
    while (!links_.empty()) {
      const std::string link = std::move(links_.front());
      links_.pop_front();
      folder(link, false);
    }
  }

 private:
  struct Entry {
    std::string name;
    unsigned char type;
  };

  void folder(const std::string& relative, bool is_root) {
    const std::string path = relative.empty() ? root_ : root_ + "/" + relative;
    const std::unique_ptr<DIR, int (*)(DIR*)> stream(::opendir(path.c_str()), ::closedir);
    if (!stream) {
      if (errno == ENOENT && !is_root) {
        return;  // removed since its name was read
      }
      throw InputError(path, "", std::string("the folder can't be listed: ") + std::strerror(errno),
                       is_root ? "Check its permissions"
                               : "Check its permissions, or leave it out with --exclude");
    }
    const int handle = ::dirfd(stream.get());
    struct stat self {};
    if (::fstat(handle, &self) != 0) {
      return;
    }
    const Identity identity{self.st_dev, self.st_ino};
    if ((!is_root && identity == skip_) || !visited_.insert(identity).second) {
      return;
    }

    std::vector<Entry> entries;
    while (const dirent* entry = ::readdir(stream.get())) {
      if (entry->d_name[0] != '.') {
        entries.push_back({entry->d_name, entry->d_type});
      }
    }
    std::sort(entries.begin(), entries.end(),
              [](const Entry& a, const Entry& b) { return a.name < b.name; });
    for (Entry& entry : entries) {
      visit(handle, relative.empty() ? entry.name : relative + "/" + entry.name, entry);
    }
  }

  void visit(int folder_handle, std::string&& relative, const Entry& entry) {
    const bool scan_name = has_scan_extension(entry.name);
    if (entry.type == DT_DIR) {
      if (!options_.filter.skips_folder(relative)) {
        folder(relative, false);
      }
      return;
    }
    if (entry.type != DT_LNK && entry.type != DT_UNKNOWN && (entry.type != DT_REG || !scan_name)) {
      return;
    }
    if (entry.type == DT_REG && !options_.filter.takes(relative)) {
      return;
    }
    struct stat status {};
    FoundScan scan;
    if (::fstatat(folder_handle, entry.name.c_str(), &status, 0) == 0) {
      if (S_ISDIR(status.st_mode)) {
        if (!options_.filter.skips_folder(relative)) {
          follow(folder_handle, relative, entry);
        }
        return;
      }
      if (!S_ISREG(status.st_mode)) {
        return;
      }
      scan.stamp = FileStamp::of(status);
    }
    if (scan_name && options_.filter.takes(relative)) {
      scan.path = root_ + "/" + relative;
      scan.relative = std::move(relative);
      found_(std::move(scan));
    }
  }

  // A folder that is, on file systems that don't tell what an entry is, or one that a link leads
  // to.
  void follow(int folder_handle, const std::string& relative, const Entry& entry) {
    struct stat itself {};
    const bool link =
        ::fstatat(folder_handle, entry.name.c_str(), &itself, AT_SYMLINK_NOFOLLOW) != 0 ||
        S_ISLNK(itself.st_mode);
    if (link) {
      links_.push_back(relative);
    } else {
      folder(relative, false);
    }
  }

  std::string root_;
  const WalkOptions& options_;
  const std::function<void(FoundScan&&)>& found_;
  Identity skip_{0, 0};
  std::set<Identity> visited_;
  std::deque<std::string> links_;  ///< paths of links to folders
};

}  // namespace

ScanName split_scan_name(std::string_view file_name) {
  std::string_view stem = file_name;
  std::string_view extension = last_extension(stem);
  if (extension.empty()) {
    return {std::string(file_name), ""};
  }
  stem.remove_suffix(extension.size() + 1);
  if (one_of(extension, kPacked)) {
    const std::string_view inner = last_extension(stem);
    if (!inner.empty()) {
      stem.remove_suffix(inner.size() + 1);
    }
  }
  extension = file_name.substr(stem.size() + 1);
  return {std::string(stem), std::string(extension)};
}

bool has_scan_extension(std::string_view file_name) {
  std::string_view extension = last_extension(file_name);
  if (one_of(extension, kPacked)) {
    file_name.remove_suffix(extension.size() + 1);
    extension = last_extension(file_name);
  }
  return one_of(extension, kKnown);
}

void walk_scans(const std::string& folder, const WalkOptions& options,
                const std::function<void(FoundScan&&)>& found) {
  Walk(folder, options, found).run();
}

}  // namespace rattan
