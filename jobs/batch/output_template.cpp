// SPDX-License-Identifier: MIT
#include "jobs/batch/output_template.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "engine/core/errors.h"
#include "jobs/batch/collect.h"

namespace rattan {

namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 4> kOurs = {"dir", "stem", "ext", "root"};
constexpr std::array<std::string_view, 3> kOfSizes = {"faces", "size", "n"};

template <std::size_t N>
bool one_of(std::string_view word, const std::array<std::string_view, N>& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

// Calls literal(text) and name(text) in turn.
template <class Literal, class Name>
void parts(std::string_view text, const Literal& literal, const Name& name) {
  while (!text.empty()) {
    const std::size_t open = text.find('{');
    literal(text.substr(0, open));
    if (open == std::string_view::npos) {
      return;
    }
    const std::size_t close = text.find('}', open);
    if (close == std::string_view::npos) {
      name(text.substr(open + 1), false);
      return;
    }
    name(text.substr(open + 1, close - open - 1), true);
    text = text.substr(close + 1);
  }
}

/// An output file and whose it is.
struct Output {
  std::string path;
  std::uint32_t item;
};

std::string remedy(const BatchItem& a, const BatchItem& b) {
  const fs::path first(a.scan);
  const fs::path second(b.scan);
  const std::string suffix = fs::path(a.id).extension().string();
  if (a.scan == b.scan) {
    return "The scan is asked for twice: give the rows different names in the column output.";
  }
  if (first.parent_path() == second.parent_path()) {
    return fmt::format("Tell them apart with --name '{{dir}}/{{stem}}-{{ext}}{}'.", suffix);
  }
  return fmt::format(
      "Tell them apart with --name '{{root}}/{{dir}}/{{stem}}{}', or give them names in the column "
      "output of a manifest.",
      suffix);
}

[[noreturn]] void refuse(std::span<const BatchItem> items, const Output& a, const Output& b,
                         const std::string& what, std::size_t more) {
  const BatchItem& first = items[std::min(a.item, b.item)];
  const BatchItem& second = items[std::max(a.item, b.item)];
  throw UsageError(
      fmt::format("{}: {} {} and {}{}. {}", a.path, what, first.scan, second.scan,
                  more == 0 ? std::string() : fmt::format(" (and {} more such outputs)", more),
                  remedy(first, second)));
}

// Folders are resolved once each: a path with links and one without may be the same file.
class RealPaths {
 public:
  std::string operator()(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    const std::string folder = path.substr(0, slash);
    if (folder != folder_) {
      std::error_code error;
      const fs::path real = fs::weakly_canonical(folder.empty() ? "/" : folder, error);
      real_ = error ? folder : real.string();
      folder_ = folder;
    }
    return real_ + path.substr(slash);
  }

 private:
  std::string folder_ = "?";
  std::string real_;
};

void check_scans_stay(std::span<const BatchItem> items, const std::vector<Output>& outputs,
                      const std::string& directory) {
  RealPaths real;
  std::vector<std::pair<std::string, std::uint32_t>> scans;
  scans.reserve(items.size());
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    scans.emplace_back(real(items[i].scan), i);
  }
  std::sort(scans.begin(), scans.end());
  for (const Output& output : outputs) {
    const std::string path = real(directory + "/" + output.path);
    const auto scan = std::lower_bound(scans.begin(), scans.end(), std::pair(path, 0U));
    if (scan != scans.end() && scan->first == path) {
      throw UsageError(fmt::format(
          "{}: the remesh of {} would replace this scan of the batch. Write to another folder with "
          "-o, or give the remeshes other names, e.g. --name '{{dir}}/{{stem}}-remesh{}'.",
          items[scan->second].scan, items[output.item].scan,
          fs::path(output.path).extension().string()));
    }
  }
}

}  // namespace

OutputTemplate::OutputTemplate(std::string text) : text_(std::move(text)) {
  parts(
      text_, [](std::string_view) {},
      [&](std::string_view name, bool closed) {
        if (!closed || (!one_of(name, kOurs) && !one_of(name, kOfSizes))) {
          throw UsageError(
              fmt::format("--name {}: '{{{}' is no part of a name. There are {{dir}}, {{stem}}, "
                          "{{ext}}, {{root}}, "
                          "and for several sizes {{faces}}, {{size}} and {{n}}.",
                          text_, closed ? std::string(name) + "}" : std::string(name)));
        }
      });
}

std::string OutputTemplate::operator()(const ScanPlace& place) const {
  const ScanName name = split_scan_name(place.file_name);
  std::string output;
  parts(
      text_, [&](std::string_view literal) { output += literal; },
      [&](std::string_view part, bool) {
        if (part == "dir") {
          output += place.folder;
        } else if (part == "stem") {
          output += name.stem;
        } else if (part == "ext") {
          output += name.extension;
        } else if (part == "root") {
          output += place.root;
        } else {
          output += fmt::format("{{{}}}", part);
        }
      });
  // "{dir}/{stem}" with an empty {dir}.
  return output.substr(std::min(output.find_first_not_of('/'), output.size()));
}

std::string checked_output(std::string_view output, const std::string& place) {
  const fs::path path = fs::path(output).lexically_normal();
  const std::string first = path.empty() ? "" : path.begin()->string();
  if (output.starts_with('/') || first == ".." || path.empty()) {
    throw UsageError(fmt::format(
        "{}: the output {} doesn't lie below the batch's folder. Give a path relative to that.",
        place, output));
  }
  if (first == ".rattan") {
    throw UsageError(
        fmt::format("{}: the output {} lies in the folder of the batch's journal. Give it another.",
                    place, output));
  }
  const std::string extension = path.extension().string();
  if (extension != ".drc" && extension != ".obj" && extension != ".ply" && extension != ".off") {
    throw UsageError(fmt::format(
        "{}: the extension of the output {} says which format to write. Use .drc, .obj, .ply or "
        ".off.",
        place, output));
  }
  return path.string();
}

void check_outputs(std::span<const BatchItem> items, const std::string& directory) {
  std::vector<Output> outputs;
  outputs.reserve(items.size());
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    for (std::string& name : item_outputs(items[i])) {
      outputs.push_back({fs::path(std::move(name)).lexically_normal().string(), i});
    }
  }
  std::sort(outputs.begin(), outputs.end(), [](const Output& a, const Output& b) {
    return a.path != b.path ? a.path < b.path : a.item < b.item;
  });
  const auto twice = [&](std::size_t i) { return outputs[i].path == outputs[i + 1].path; };
  for (std::size_t i = 0; i + 1 < outputs.size(); ++i) {
    if (twice(i)) {
      std::size_t more = 0;
      for (std::size_t j = i + 1; j + 1 < outputs.size(); ++j) {
        more += twice(j) ? 1 : 0;
      }
      refuse(items, outputs[i], outputs[i + 1], "this would be the output of", more);
    }
  }
  for (const Output& output : outputs) {
    for (std::size_t slash = output.path.rfind('/'); slash != std::string::npos && slash > 0;
         slash = output.path.rfind('/', slash - 1)) {
      const std::string folder = output.path.substr(0, slash);
      const auto file =
          std::lower_bound(outputs.begin(), outputs.end(), folder,
                           [](const Output& a, const std::string& b) { return a.path < b; });
      if (file != outputs.end() && file->path == folder) {
        refuse(items, *file, output, "this would be an output and a folder for another, of", 0);
      }
    }
  }
  if (!directory.empty()) {
    check_scans_stay(items, outputs, directory);
  }
}

}  // namespace rattan
