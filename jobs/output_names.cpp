// SPDX-License-Identifier: MIT
#include "jobs/output_names.h"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "engine/core/errors.h"
#include "jobs/size_list.h"

namespace rattan {

namespace {

namespace fs = std::filesystem;

bool replace(std::string& text, std::string_view what, const std::string& by) {
  bool any = false;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at)) {
    text.replace(at, what.size(), by);
    at += by.size();
    any = true;
  }
  return any;
}

void check_name(const std::string& name, const std::string& scan) {
  const fs::path path(name);
  const std::string extension = path.extension().string();
  if (extension != ".drc" && extension != ".obj" && extension != ".ply" && extension != ".off") {
    throw UsageError(name +
                     ": the extension says which format to write. Use .drc, "
                     ".obj, .ply or .off.");
  }
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    throw UsageError(folder.string() + ": there is no such folder to write " + name +
                     " into. Create it first.");
  }
  if (fs::equivalent(path, scan, ignored)) {
    throw UsageError(name + ": the remesh would replace the scan itself. Give it another name.");
  }
}

}  // namespace

std::vector<std::string> expand_names(const std::string& path, SizeKind kind,
                                      std::span<const double> sizes) {
  if (sizes.size() == 1) {
    return {path};
  }
  if (kind != SizeKind::kFaces && path.find("{faces}") != std::string::npos) {
    throw UsageError(path +
                     ": the numbers of faces are not known beforehand. Use {size} or {n} instead "
                     "of {faces}.");
  }
  std::vector<std::string> names;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    std::string name = path;
    const std::string size = size_text(sizes[i]);
    bool any = replace(name, "{faces}", size);
    any |= replace(name, "{size}", size);
    any |= replace(name, "{n}", fmt::format("{}", i + 1));
    if (!any) {
      const fs::path p(name);
      name = (p.parent_path() / (p.stem().string() + "-" + size + p.extension().string())).string();
    }
    names.push_back(std::move(name));
  }
  std::vector<std::string> sorted;
  sorted.reserve(names.size());
  for (const std::string& name : names) {
    sorted.push_back(fs::path(name).lexically_normal().string());
  }
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) {
    throw UsageError(*twice +
                     ": two sizes would be written to this file. Ask for different sizes, or name "
                     "the files with {n}.");
  }
  return names;
}

std::vector<std::string> output_names(const RemeshOptions& options) {
  std::vector<std::string> names = expand_names(options.output, options.size_kind, options.sizes);
  for (const std::string& name : names) {
    check_name(name, options.scan);
  }
  return names;
}

}  // namespace rattan
