// SPDX-License-Identifier: MIT
#include "jobs/batch/batch_files.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"

namespace rattan {

namespace fs = std::filesystem;

namespace {

bool is_file(const std::string& path, std::uint64_t& bytes) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) {
    return false;
  }
  bytes = static_cast<std::uint64_t>(status.st_size);
  return true;
}

std::string own_program() {
  std::error_code error;
  const fs::path path = fs::read_symlink("/proc/self/exe", error);
  return error ? "rattan" : path.string();
}

}  // namespace

ItemFiles::ItemFiles(const BatchItem& item, const BatchRunOptions& options) {
  const std::string& directory = options.directory;
  output = directory + "/" + item.id;
  log = output + ".log";
  report_folder = directory + "/report/" + item.id;
  report = report_folder + "/report.json";
  if (!item.what->remesh.work_dir.empty()) {
    work = item.what->remesh.work_dir;
  } else if (!options.work_directory.empty()) {
    work = options.work_directory + "/" + item.id + ".work";
  } else {
    work = directory + "/" + item_outputs(item)[0] + ".work";
  }
}

void ItemFiles::make_folders() const {
  for (const fs::path& folder : {fs::path(output).parent_path(), fs::path(report_folder)}) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) {
      throw ResourceError(fmt::format(
          "{}: the folder cannot be made ({}). Make room there or choose another with -o.",
          folder.string(), error.message()));
    }
  }
}

std::vector<std::string> child_command(const BatchItem& item, const BatchRunOptions& options,
                                       int threads, std::uint64_t memory, bool fresh) {
  const ItemFiles files(item, options);
  std::vector<std::string> words = {options.program.empty() ? own_program() : options.program,
                                    "remesh", item.scan, "-o", files.output};
  const std::vector<std::string>& asked = item.what->words;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (asked[i] == "--threads" || asked[i] == "--memory") {  // decided here
      ++i;
      continue;
    }
    words.push_back(asked[i]);
  }
  const auto add = [&](const char* name, std::string value) {
    words.emplace_back(name);
    words.push_back(std::move(value));
  };
  if (item.what->remesh.work_dir.empty() && !options.work_directory.empty()) {
    add("--work-dir", files.work);
  }
  if (fresh) {
    words.emplace_back("--fresh");
  }
  add("--threads", std::to_string(threads));
  add("--memory", std::to_string(memory));
  add("--log-format", "json");
  add("--report", files.report);
  if (options.report) {
    add("--thumbnail", files.report_folder + "/thumbnail.png");
    add("--viewer", files.report_folder + "/view.js");
  }
  return words;
}

std::vector<OutputFile> written_outputs(const BatchItem& item, const BatchRunOptions& options) {
  std::vector<OutputFile> outputs;
  for (std::string& name : item_outputs(item)) {
    std::uint64_t bytes = 0;
    if (is_file(options.directory + "/" + name, bytes)) {
      outputs.push_back({std::move(name), bytes});
    }
  }
  return outputs;
}

bool finished_unseen(const BatchItem& item, const BatchRunOptions& options, FoundReport& found) {
  const ItemFiles files(item, options);
  std::ifstream in(files.report);
  if (!in) {
    return false;
  }
  try {
    const nlohmann::json report = nlohmann::json::parse(in);
    const auto& outputs = report.at("outputs");
    const std::vector<std::string> names = item_outputs(item);
    if (report.at("input").at("path") != item.scan || outputs.size() != names.size()) {
      return false;
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      std::uint64_t bytes = 0;
      if (!is_file(options.directory + "/" + names[i], bytes) ||
          outputs.at(i).at("bytes") != bytes) {
        return false;
      }
    }
    found.seconds = report.at("seconds");
    found.peak_rss_bytes = report.at("peak_rss_bytes");
    found.warnings = report.at("warnings").size();
    return true;
  } catch (const nlohmann::json::exception&) {
    return false;
  }
}

bool write_text(const std::string& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << text;
  out.close();
  return !out.fail();
}

}  // namespace rattan
