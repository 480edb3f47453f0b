// SPDX-License-Identifier: MIT
#include "jobs/slurm/submission.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <unistd.h>
#include <unordered_map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "jobs/batch/forecast.h"
#include "jobs/batch/journal.h"
#include "jobs/batch/manifest.h"

namespace rattan {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

fs::path slurm_folder(const std::string& directory) {
  return fs::path(directory) / ".rattan/slurm";
}

/// Folders of submissions by their numbers.
std::map<std::uint64_t, fs::path> submissions_of(const std::string& directory) {
  std::map<std::uint64_t, fs::path> found;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(slurm_folder(directory), error)) {
    const std::string name = entry.path().filename().string();
    if (!name.empty() && name.size() < 10 && name.find_first_not_of("0123456789") == name.npos) {
      found.emplace(std::stoull(name), entry.path());
    }
  }
  return found;
}

std::vector<SubmittedJob> submitted_jobs(const fs::path& folder) {
  std::vector<SubmittedJob> jobs;
  std::ifstream stream(folder / "jobs");
  SubmittedJob job;
  while (stream >> job.name >> job.first >> job.id) {
    jobs.push_back(job);
  }
  return jobs;
}

Json read_plan(const fs::path& folder) {
  std::ifstream stream(folder / "plan.json");
  return stream ? Json::parse(stream, nullptr, false) : Json();
}

/// Numbers of an array's tasks that are queued or at work.
std::set<std::uint32_t> live_tasks(const std::string& job, const CommandRunner& run) {
  const CommandOutput answer =
      run({"squeue", "--noheader", "--array", "--format=%K", "--jobs=" + job});
  std::set<std::uint32_t> tasks;
  if (answer.code != 0 && answer.error.find("Invalid job id") == std::string::npos) {
    throw ResourceError(
        fmt::format("Slurm doesn't say what became of job {} ({}). Try again when it answers.", job,
                    answer.code == 127 ? "squeue isn't to be found"
                                       : answer.error.substr(0, answer.error.find('\n'))));
  }
  std::istringstream lines(answer.out);
  std::uint32_t task = 0;
  while (lines >> task) {
    tasks.insert(task);
  }
  return tasks;
}

TaskScan forecast_of(const BatchItem& item) {
  const Forecast f = forecast(item);
  // In thousandths, so that the sums come out alike wherever the manifest is read.
  const double cost = item.cost > 0.0 ? item.cost : f.cpu_seconds;
  return {std::max(std::round(cost * 1000.0) / 1000.0, 0.001), f.least_memory,
          std::max(f.good_memory, f.least_memory)};
}

void write_file(const fs::path& path, const std::string& text, bool executable) {
  AtomicFile file(path.string());
  file.write(text);
  file.commit();
  if (executable) {
    fs::permissions(path, fs::perms::owner_exec | fs::perms::group_exec | fs::perms::others_exec,
                    fs::perm_options::add);
  }
}

/// What read_scans_in_hand() and people want to know of the submission later.
Json plan_json(const std::vector<BatchItem>& items, const std::vector<TaskScan>& scans,
               const std::vector<TaskArray>& arrays, const SubmissionRequest& request) {
  Json keys = Json::array();
  std::unordered_map<std::string, std::size_t> key_index;
  Json list = Json::array();
  for (const TaskArray& array : arrays) {
    Json members = Json::array();
    for (std::size_t k = 0; k < array.scans.size(); ++k) {
      const BatchItem& item = items[array.scans[k]];
      const auto [at, added] = key_index.try_emplace(item.what->key, key_index.size());
      if (added) {
        keys.push_back(item.what->key);
      }
      members.push_back({{"id", item.id},
                         {"scan", item.scan},
                         {"key", at->second},
                         {"task", array.task[k] + 1},
                         {"cpu_seconds", scans[array.scans[k]].cpu_seconds}});
    }
    list.push_back({{"name", array.name},
                    {"tasks", array.tasks},
                    {"cpus_per_task", array.processors},
                    {"mebibytes", array.mebibytes},
                    {"minutes", array.minutes},
                    {"longest_seconds", array.longest_seconds},
                    {"scans", std::move(members)}});
  }
  return {{"command", request.command}, {"arrays", std::move(list)}, {"keys", std::move(keys)}};
}

/// Throws where a task that is still to run, or runs, would undo what is asked for now.
bool in_hand(const BatchItem& item, const ScansInHand& hands) {
  const auto at = hands.by_id.find(item.id);
  if (at == hands.by_id.end()) {
    return false;
  }
  if (at->second.key != item.what->key || at->second.scan != item.scan) {
    throw UsageError(fmt::format(
        "{}: task {} of an earlier submission is still to make it from another scan or with other "
        "options. Wait until that has ended, or end it: scancel {}.",
        item.id, at->second.task, fmt::join(hands.jobs, " ")));
  }
  return true;
}

void warn_of_memory(const std::vector<BatchItem>& items, const std::vector<TaskScan>& scans,
                    Submission& submission) {
  for (const TaskArray& array : submission.arrays) {
    for (const std::uint32_t k : array.scans) {
      const std::uint64_t least = (scans[k].least_memory + kMiB - 1) / kMiB;
      if (array.mebibytes > 0 && memory_inside(array.mebibytes) < least) {
        submission.warnings.push_back(
            fmt::format("{} needs some {} MiB at least, and its task has {} MiB. Ask for more with "
                        "--mem, or name another --partition.",
                        items[k].scan, least, memory_inside(array.mebibytes)));
      }
    }
  }
}

/// The next number, as a folder that nobody else has.
fs::path new_folder(const std::string& directory) {
  const auto before = submissions_of(directory);
  std::uint64_t number = before.empty() ? 1 : before.rbegin()->first + 1;
  while (!fs::create_directory(slurm_folder(directory) / std::to_string(number))) {
    ++number;
  }
  return slurm_folder(directory) / std::to_string(number);
}

void write_folder(const std::vector<BatchItem>& items, const std::vector<TaskScan>& scans,
                  const SubmissionRequest& request, const Submission& submission) {
  const fs::path folder = submission.folder;
  for (const TaskArray& array : submission.arrays) {
    std::vector<BatchItem> members;
    std::vector<double> costs;
    for (const std::uint32_t k : array.scans) {
      members.push_back(items[k]);
      costs.push_back(scans[k].cpu_seconds);
    }
    write_manifest((folder / (array.name + ".jsonl")).string(), members, costs);
    write_file(folder / (array.name + ".sh"), task_script(array, request.script), true);
  }
  write_file(folder / "merge.sh", merge_script(request.script), true);
  write_file(folder / "submit.sh", submit_script(submission.arrays, request.script), true);
  write_file(folder / "plan.json",
             plan_json(items, scans, submission.arrays, request)
                     .dump(1, ' ', false, Json::error_handler_t::replace) +
                 "\n",
             false);
}

}  // namespace

std::string submission_lock(const std::string& directory) {
  return (slurm_folder(directory) / "lock").string();
}

std::string slurm_manifest(const std::string& directory) {
  return (slurm_folder(directory) / "manifest.jsonl").string();
}

ScansInHand read_scans_in_hand(const std::string& directory, const CommandRunner& run) {
  ScansInHand hands;
  for (const auto& [number, folder] : submissions_of(directory)) {
    std::map<std::string, std::vector<std::pair<SubmittedJob, std::set<std::uint32_t>>>> live;
    for (const SubmittedJob& job : submitted_jobs(folder)) {
      if (job.name == "merge") {
        continue;
      }
      std::set<std::uint32_t> tasks = live_tasks(job.id, run);
      if (!tasks.empty()) {
        hands.jobs.push_back(job.id);
        live[job.name].emplace_back(job, std::move(tasks));
      }
    }
    if (live.empty()) {
      continue;
    }
    const Json plan = read_plan(folder);
    if (!plan.is_object()) {
      throw ResourceError(fmt::format("{} can't be read, and its jobs are still in the queue.",
                                      (folder / "plan.json").string()));
    }
    for (const Json& array : plan.at("arrays")) {
      for (const auto& [job, tasks] : live[array.at("name").get<std::string>()]) {
        for (const Json& member : array.at("scans")) {
          const auto task = member.at("task").get<std::uint32_t>();
          if (task > job.first && tasks.contains(task - job.first)) {
            hands.by_id.insert_or_assign(
                member.at("id").get<std::string>(),
                ScansInHand::Hand{fmt::format("{}_{}", job.id, task - job.first),
                                  member.at("scan").get<std::string>(),
                                  plan.at("keys").at(member.at("key").get<std::size_t>())});
          }
        }
      }
    }
  }
  return hands;
}

Submission prepare_submission(const std::vector<BatchItem>& items, SubmissionRequest request,
                              const SlurmSite& site, const CommandRunner& run) {
  if (request.directory.find('\\') != std::string::npos) {
    throw UsageError(request.directory +
                     ": Slurm can't write logs below a folder with a backslash in its name. Name "
                     "another with -o.");
  }
  fs::create_directories(slurm_folder(request.directory) / "logs");
  BatchRunOptions options;
  options.directory = request.directory;
  options.retry_failed = request.retry_failed;
  const std::vector<Standing> standings = plan_batch(items, options);
  const ScansInHand hands = read_scans_in_hand(request.directory, run);

  Submission submission;
  submission.selected = items.size();
  std::vector<BatchItem> missing;
  std::vector<TaskScan> scans;
  for (std::size_t k = 0; k < items.size(); ++k) {
    if (standings[k] == Standing::kDone) {
      ++submission.done;
    } else if (standings[k] == Standing::kFailed) {
      ++submission.failed;
    } else if (in_hand(items[k], hands)) {
      ++submission.in_hand;
    } else {
      missing.push_back(items[k]);
      scans.push_back(forecast_of(items[k]));
    }
  }
  submission.to_do = missing.size();
  submission.arrays = plan_tasks(scans, request.wishes, site);
  warn_of_memory(missing, scans, submission);

  write_manifest(slurm_manifest(request.directory), items, {});
  BatchRecord record;
  record.action = "submit";
  record.time = unix_seconds();
  record.host = this_host();
  record.pid = ::getpid();
  record.total = items.size();
  record.items = missing.size();
  JournalWriter(request.directory).append(record);
  if (missing.empty()) {
    return submission;
  }

  submission.folder = new_folder(request.directory).string();
  request.script.directory = request.directory;
  request.script.folder = submission.folder;
  request.script.most_tasks = site.most_tasks;
  request.script.merge_minutes =
      std::min(request.script.merge_minutes, site.most_minutes.value_or(60));
  request.script.earlier_jobs = hands.jobs;
  if (request.retry_failed) {
    request.script.batch_words.emplace_back("--retry-failed");
  }
  write_folder(missing, scans, request, submission);
  return submission;
}

std::vector<SubmittedJob> submit(const std::string& folder, const CommandRunner& run) {
  const CommandOutput answer = run({"bash", (fs::path(folder) / "submit.sh").string()});
  std::vector<SubmittedJob> jobs = submitted_jobs(folder);
  if (answer.code != 0) {
    std::string words = answer.error;
    while (words.ends_with('\n')) {
      words.pop_back();
    }
    throw ResourceError(fmt::format("Slurm didn't take {}: {}{}",
                                    (fs::path(folder) / "submit.sh").string(), words,
                                    jobs.empty() ? ""
                                                 : "\nWhat it took before runs on; the same "
                                                   "command submits the rest."));
  }
  return jobs;
}

MissingScans find_missing(const std::vector<BatchItem>& items, const std::string& directory,
                          const CommandRunner& run) {
  BatchRunOptions options;
  options.directory = directory;
  const std::vector<Standing> standings = plan_batch(items, options);
  MissingScans missing;
  ScansInHand hands;
  if (std::ranges::any_of(standings, to_do)) {
    hands = read_scans_in_hand(directory, run);
  }
  for (std::size_t k = 0; k < items.size(); ++k) {
    if (!to_do(standings[k])) {
      continue;
    }
    if (hands.by_id.contains(items[k].id)) {
      ++missing.in_hand;
    } else {
      missing.scans.emplace_back(items[k].id, standings[k]);
    }
  }
  const auto submissions = submissions_of(directory);
  if (!submissions.empty()) {
    const Json plan = read_plan(submissions.rbegin()->second);
    if (plan.is_object()) {
      missing.command = plan.value("command", "");
    }
  }
  return missing;
}

}  // namespace rattan
